#!/usr/bin/env python3
"""Makes a page of a shot from the log of a run: each frame's input and result with a slider between them, and charts over the frames.

    fathom ssao shot.####.exr --camera cam.json -o ao.####.exr --radius 0.6 --log run.jsonl
    examples/report.py run.jsonl -o report.html

The page is one file and needs no network. Pictures are those of `fathom show`; all frames have the same range of values. Of each
result the log's last line counts. A frame that failed is listed with its error.
"""

import argparse
import base64
import html
import json
import os
import pathlib
import subprocess
import sys
import tempfile

PAGE = """<!DOCTYPE html><html lang="en"><meta charset="utf-8"><title>{title}</title><style>
body {{ font: 15px system-ui, sans-serif; max-width: 720px; margin: 24px auto; color: #222; }}
code {{ background: #f2f2f2; padding: 2px 4px; overflow-wrap: anywhere; }}
#stage {{ position: relative; }} #stage img {{ width: 100%; display: block; }}
#stage #input {{ position: absolute; top: 0; left: 0; }}
input[type=range] {{ width: 100%; }} svg {{ width: 100%; height: auto; }} .told {{ color: #a33; }}
</style><h1>{title}</h1><p><code>{command}</code></p><p>{run}</p>
<div id="stage"><img id="result" alt="result"><img id="input" alt="input"></div>
<label>Input and result <input id="split" type="range" value="50"></label>
<label>Frame <b id="name"></b> <input id="frame" type="range" min="0" max="{last}" value="0"></label><p id="words"></p>
{charts}<ul class="told">{told}</ul>
<script>
const frames = {frames}, of = name => document.getElementById(name);
function show() {{
    const frame = frames[of("frame").value];
    of("name").textContent = frame.name;
    of("words").textContent = frame.words;
    of("result").src = frame.result;
    of("input").src = frame.input;
    of("input").style.clipPath = `inset(0 ${{100 - of("split").value}}% 0 0)`;
}}
of("frame").oninput = of("split").oninput = show;
show();
</script></html>
"""


def read_log(name):
    """The last run, and the last line of each result, in the order of the frames."""
    run, lines = {}, {}
    for number, text in enumerate(open(name, encoding="utf-8"), 1):
        try:
            line = json.loads(text)
        except json.JSONDecodeError as error:
            sys.exit(f"report.py: {name}, line {number}: is no JSON ({error}); give the file of --log")
        if "run" in line:
            run = line["run"]
        elif "status" in line:
            result = line.get("output") or next(iter(line.get("outputs", [])), line.get("input"))
            lines[result] = line
    if not lines:
        sys.exit(f"report.py: {name}: has no frames; give the file of --log")
    return run, lines


def shown(file, options):
    """A picture of a file by `fathom show`, as data of a page, and what it says of the values."""
    with tempfile.TemporaryDirectory() as folder:
        picture = os.path.join(folder, "shown.png")
        command = [os.environ.get("FATHOM", "fathom"), "show", file, "-o", picture, "--json", *options]
        ran = subprocess.run(command, capture_output=True, text=True)
        if ran.returncode != 0:
            return None, ran.stderr.strip()
        data = base64.b64encode(pathlib.Path(picture).read_bytes()).decode()
        return "data:image/png;base64," + data, json.loads(ran.stdout)


def common_range(said):
    """The range that holds all frames' values, for `fathom show`; nothing where they are pictures or normals."""
    ends = [one["range"] for one in said if isinstance(one, dict) and "range" in one]
    return [f"--range={min(low for low, _ in ends)}:{max(high for _, high in ends)}"] if ends else []


def pictures_of(files, options):
    """Pictures of files that have the same range, and what is said of each: a word of what is wrong where there is none."""
    first = [shown(file, options)[1] for file in files]
    return [shown(file, options + common_range(first)) for file in files]


def chart(title, names, series):
    """A chart over the frames, as SVG: `series` has a colour and a value a frame for each name."""
    width, height, left = 1000, 180, 60
    values = [value for _, points in series.values() for value in points if isinstance(value, (int, float))]
    if not values:
        return ""
    low, high = min(values + [0]), max(values)
    high = high if high > low else low + 1
    place = lambda i, value: (left + i * (width - left - 10) / max(len(names) - 1, 1),
                              height - 20 - (value - low) / (high - low) * (height - 45))
    lines = "".join(
        f'<polyline fill="none" stroke="{colour}" points="'
        + " ".join("%.1f,%.1f" % place(i, value) for i, value in enumerate(points) if isinstance(value, (int, float)))
        + '"/>' for colour, points in series.values())
    words = " ".join(f'<tspan fill="{colour}">{html.escape(name)}</tspan>' for name, (colour, _) in series.items())
    return (f'<h3>{html.escape(title)}</h3><svg viewBox="0 0 {width} {height}" font-size="13"><text x="{left}" y="14">{words}</text>'
            f'<text x="0" y="30">{high:.4g}</text><text x="0" y="{height - 20}">{low:.4g}</text>'
            f'<text x="{left}" y="{height - 2}">{html.escape(names[0])} to {html.escape(names[-1])}</text>{lines}</svg>')


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("log", help="the file of --log")
    parser.add_argument("-o", "--output", default="report.html", help="the page (default: report.html)")
    parser.add_argument("--map", default="viridis", help="colours of results, as `fathom show` has them (default: viridis)")
    arguments = parser.parse_args()
    run, lines = read_log(arguments.log)
    folder = pathlib.Path(run.get("folder", "."))  # from which the run named its files

    done = {result: line for result, line in lines.items() if line["status"] != "failed"}
    told = [f'{line.get("input", result)}: {line["error"]}' for result, line in lines.items() if line["status"] == "failed"]
    told += [words for line in done.values() for words in line.get("warnings", [])]
    results = pictures_of([folder / result for result in done], ["--map", arguments.map])
    inputs = pictures_of([folder / line["input"] for line in done.values()], [])
    frames = []
    for (result, line), (picture, said), (input_picture, _) in zip(done.items(), results, inputs):
        if picture is None:
            told.append(said)
        words = f'{line["width"]} × {line["height"]}, {line["seconds"]:.3f} s, {line.get("invalid", 0)} pixels invalid'
        frames.append({"name": str(line.get("frame", result)), "words": words, "result": picture or "",
                       "input": input_picture or "", "said": said if picture else {}})
    if not frames:
        sys.exit(f"report.py: {arguments.log}: no frame was made: {told[0]}")

    command = [os.path.basename(word) for word in run.get("command", [])[:1]] + run.get("command", [])[1:]
    names = [frame["name"] for frame in frames]
    of_log = lambda key: [line.get(key) for line in done.values()]
    charts = chart("Seconds", names, {"read": ("#2f6fc4", of_log("read_seconds")), "compute": ("#d2691e", of_log("compute_seconds")),
                                      "write": ("#6d7f94", of_log("write_seconds"))})
    charts += chart("Result", names, {"least": ("#2f6fc4", [frame["said"].get("min") for frame in frames]),
                                      "greatest": ("#d2691e", [frame["said"].get("max") for frame in frames])})
    charts += chart("Pixels of the depth that are invalid", names, {"invalid": ("#b0357f", of_log("invalid"))})
    for frame in frames:
        del frame["said"]
    page = PAGE.format(
        title=html.escape(pathlib.Path(arguments.log).name), command=html.escape(" ".join(command)),
        run=html.escape(", ".join(str(run[key]) for key in ("version", "device", "started") if key in run)),
        last=len(frames) - 1, charts=charts, told="".join(f"<li>{html.escape(words)}</li>" for words in dict.fromkeys(told)),
        frames=json.dumps(frames).replace("</", "<\\/"))
    pathlib.Path(arguments.output).write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
