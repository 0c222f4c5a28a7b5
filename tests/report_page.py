"""usage: report_page.py FATHOM

Looks at a page of `fathom report` in Chromium as people do: with a pointer, with keys, wide and narrow, light and dark.
Skipped (exit 77) where Chromium, its driver or the package selenium is missing.
"""
import base64
import io
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time

try:
    import numpy as np
    from PIL import Image
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service
    from selenium.webdriver.common.action_chains import ActionChains
    from selenium.webdriver.common.by import By
    from selenium.webdriver.common.keys import Keys
except ImportError as error:
    print(f"skipped: {error}")
    sys.exit(77)

CHROMIUM, DRIVER = shutil.which("chromium"), shutil.which("chromedriver")
if not CHROMIUM or not DRIVER:
    print("skipped: there is no chromium with its chromedriver")
    sys.exit(77)

FATHOM = os.path.abspath(sys.argv[1])
FRAMES, WIDTH, HEIGHT = 6, 480, 270
# A code of 255. Browsers scale pictures in ways of their own; the pictures are smooth but for one edge.
MEAN_DIFFERENCE = 2.0
LEAST_CONTRAST = 10 * MEAN_DIFFERENCE  # by which the wrong picture differs at least
LIGHT, DARK = ("light", 230, 255), ("dark", 0, 60)  # the lightness of the page

failures, checks = [], 0


def check(what, good, more=""):
    global checks
    checks += 1
    if not good:
        failures.append(what)
        print(f"FAILED: {what} {more}")


def write_pfm(path, values):
    with open(path, "wb") as file:
        file.write(f"Pf\n{values.shape[1]} {values.shape[0]}\n-1\n".encode())
        file.write(values[::-1].astype("<f4").tobytes())


def make_shot(folder):
    """Depth that falls from left to right, results that rise downwards and have holes, and a log of both."""
    x, y = np.meshgrid(np.linspace(0, 1, WIDTH), np.linspace(0, 1, HEIGHT))
    lines = [{"run": {"command": ["fathom", "linearize", "shot.####.pfm", "-o", "z.####.pfm"], "folder": folder,
                      "version": "0.0", "device": "cpu"}}]
    for frame in range(1, FRAMES + 1):
        write_pfm(f"{folder}/shot.{frame:04}.pfm", 9 - 8 * x)
        result = 1 + 8 * y * (1 + frame / FRAMES)
        result[: 8 * frame, :16] = np.nan
        write_pfm(f"{folder}/z.{frame:04}.pfm", result)
        lines.append({"frame": frame, "input": f"shot.{frame:04}.pfm", "output": f"z.{frame:04}.pfm",
                      "status": "made", "seconds": 0.04, "read_seconds": 0.01, "compute_seconds": 0.02,
                      "write_seconds": 0.01, "warnings": ["</script><b>mind</b>"] if frame == 2 else [],
                      "camera": {"encoding": "view-z"}})
    lines.append({"frame": 7, "input": "shot.0007.pfm", "output": "z.0007.pfm", "status": "failed",
                  "error": "shot.0007.pfm: is damaged"})
    with open(f"{folder}/run.jsonl", "w") as file:
        file.write("".join(json.dumps(line) + "\n" for line in lines))


def browser():
    options = webdriver.ChromeOptions()
    options.binary_location = CHROMIUM
    for argument in ("--headless=new", "--no-sandbox", "--hide-scrollbars", "--disable-gpu", "--disable-dev-shm-usage",
                     "--force-color-profile=srgb", "--window-size=1400,1000"):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    return webdriver.Chrome(options=options, service=Service(DRIVER))


def screen(driver, width, height, scheme):
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride",
                           {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 500})
    driver.execute_cdp_cmd("Emulation.setEmulatedMedia",
                           {"features": [{"name": "prefers-color-scheme", "value": scheme}]})


def picture_of(driver, element):
    return np.asarray(Image.open(io.BytesIO(element.screenshot_as_png)).convert("RGB")).astype(float)


def thumbnails(driver, frame, size):
    """Input and result as the page's data have them, in the size in which they are shown."""
    text = driver.execute_script("return document.getElementById('data').textContent")
    images = json.loads(text)["frames"][frame]["images"]
    decoded = [Image.open(io.BytesIO(base64.b64decode(images[key].split(",")[1]))) for key in ("input", "output")]
    return [np.asarray(image.convert("RGB").resize(size, Image.BILINEAR)).astype(float) for image in decoded]


def check_handle(driver, what, frame):
    stage = driver.find_element(By.ID, "stage")
    handle = driver.find_element(By.CSS_SELECTOR, ".handle")
    # Labels and the handle itself lie above the pictures.
    driver.execute_script("document.querySelectorAll('.side').forEach(e => e.style.visibility = 'hidden')")
    shown = picture_of(driver, stage)
    box, at = stage.rect, handle.rect["x"] + handle.rect["width"] / 2
    parted = at - box["x"]
    value = float(driver.find_element(By.ID, "compare").get_property("value"))
    check(f"{what}: the handle is where its value says", abs(parted / box["width"] * 100 - value) < 0.5,
          f"{parted / box['width'] * 100:.1f} of {value}")
    height, width = shown.shape[:2]
    given, result = thumbnails(driver, frame, (width, height))
    # Beside the knob, and without the picture's border.
    left = (slice(3, -3), slice(3, max(4, int(parted) - 26)))
    right = (slice(3, -3), slice(min(width - 4, int(parted) + 26), width - 3))
    for side, place, same, other in (("left", left, given, result), ("right", right, result, given)):
        check(f"{what}: {side} of the handle", np.abs(shown[place] - same[place]).mean() < MEAN_DIFFERENCE,
              f"differs by {np.abs(shown[place] - same[place]).mean():.1f}")
        check(f"{what}: {side} of the handle is no other picture",
              np.abs(shown[place] - other[place]).mean() > LEAST_CONTRAST,
              f"differs by {np.abs(shown[place] - other[place]).mean():.1f}")


def frame_shown(driver):
    return int(driver.find_element(By.CSS_SELECTOR, "#where b").text.split()[-1])


def check_keys(driver):
    body = driver.find_element(By.TAG_NAME, "body")
    start = frame_shown(driver)
    body.send_keys(Keys.ARROW_RIGHT)
    check("the right arrow shows the next frame", frame_shown(driver) == start + 1)
    body.send_keys(Keys.ARROW_LEFT)
    check("the left arrow shows the one before", frame_shown(driver) == start)
    body.send_keys(Keys.ARROW_LEFT * (FRAMES + 2))
    check("frames end at the first", frame_shown(driver) == 1)

    compare = driver.find_element(By.ID, "compare")
    before = float(compare.get_property("value"))
    driver.execute_script("arguments[0].focus()", compare)
    compare.send_keys(Keys.ARROW_RIGHT * 4)
    check("arrow keys move the handle", float(compare.get_property("value")) > before and frame_shown(driver) == 1)
    compare.send_keys(Keys.HOME)
    check("Home moves it to the edge", float(compare.get_property("value")) == 0)
    slider = driver.find_element(By.ID, "frame")
    slider.send_keys(Keys.END)
    check("End on the frames' slider shows the last frame", frame_shown(driver) == FRAMES + 1)
    check("a frame that failed says so", driver.find_element(By.ID, "no-picture").is_displayed()
          and "is damaged" in driver.find_element(By.ID, "facts").text)
    slider.send_keys(Keys.HOME)

    # Every stop of the Tab key is seen.
    driver.execute_script("document.querySelector('.skip').focus()")
    seen = []
    for _ in range(40):
        ActionChains(driver).send_keys(Keys.TAB).perform()
        stop = driver.switch_to.active_element
        if stop.tag_name == "body":
            break
        name = stop.accessible_name
        seen.append(stop.get_attribute("id") or stop.tag_name)
        check(f"{seen[-1]} has a name", bool(name))
        outline = driver.execute_script(
            "if (arguments[0].id === 'compare')"
            "  return getComputedStyle(document.querySelector('.handle svg')).boxShadow.includes('0px 0px 0px 4px');"
            "const style = getComputedStyle(arguments[0]);"
            "return style.outlineStyle !== 'none' && parseFloat(style.outlineWidth) >= 2", stop)
        check(f"the focus on {seen[-1]} is seen", outline)
    check("Tab reaches the handle, the frames and the buttons",
          {"compare", "frame", "play", "next"} <= set(seen), str(seen))


def check_pointer(driver):
    stage, compare = driver.find_element(By.ID, "stage"), driver.find_element(By.ID, "compare")
    width = stage.rect["width"]
    for part in (0.25, 0.8):
        ActionChains(driver).move_to_element_with_offset(stage, int((part - 0.5) * width), 0).click().perform()
        check(f"a click at {part:.0%} of the picture brings the handle there",
              abs(float(compare.get_property("value")) - 100 * part) < 1, compare.get_property("value"))
    ActionChains(driver).move_to_element_with_offset(stage, int(0.3 * width), 0).click_and_hold().move_by_offset(
            -int(0.5 * width), 0).release().perform()
    value = float(compare.get_property("value"))
    check("the handle can be dragged", abs(value - 30) < 1, str(value))


def check_looks(driver, width, scheme):
    name, low, high = scheme
    what = f"{width} px, {name}"
    inner = driver.execute_script("return [document.documentElement.scrollWidth, document.documentElement.clientWidth]")
    check(f"{what}: nothing is wider than the screen", inner[0] <= inner[1], str(inner))
    screenshot = np.asarray(Image.open(io.BytesIO(driver.get_screenshot_as_png())).convert("L")).astype(float)
    check(f"{what}: the page is {name}", low <= np.median(screenshot[:, :6]) <= high, str(np.median(screenshot[:, :6])))
    small = driver.execute_script(
        "return [...document.querySelectorAll('main *')].filter(e => e.offsetParent && e.children.length === 0 && "
        "e.textContent.trim() && parseFloat(getComputedStyle(e).fontSize) < 11).map(e => e.textContent)")
    check(f"{what}: no text is smaller than 11 px", not small, str(small))
    overlaps = driver.execute_script("""
        const found = [];
        for (const svg of document.querySelectorAll('svg.plot')) {
          const boxes = [...svg.querySelectorAll('text')].map((t) => [t.textContent, t.getBoundingClientRect()]);
          const whole = svg.parentElement.getBoundingClientRect();
          boxes.forEach(([a, p], i) => {
            if (p.left < whole.left - 1 || p.right > whole.right + 1) found.push(a + ' outside');
            boxes.slice(i + 1).forEach(([b, q]) => {
              if (p.left < q.right && q.left < p.right && p.top + 2 < q.bottom && q.top + 2 < p.bottom)
                found.push(a + ' on ' + b);
            });
          });
        }
        for (const row of document.querySelectorAll('.ticks')) {
          const boxes = [...row.children].map((t) => t.getBoundingClientRect());
          boxes.slice(1).forEach((box, i) => { if (box.left < boxes[i].right) found.push('tick ' + i); });
        }
        return found;""")
    check(f"{what}: no labels overlap", not overlaps, str(overlaps))


def check_requests(driver, page):
    """Everything that the browser itself says it asked for."""
    asked = []
    for entry in driver.get_log("performance"):
        message = json.loads(entry["message"])["message"]
        if message["method"] == "Network.requestWillBeSent":
            asked.append(message["params"]["request"]["url"])
    other = [url for url in asked if not url.startswith("data:") and url != page]
    check("the browser saw the page's own request", page in asked, str(asked[:3]))
    check("nothing else is asked for", not other, str(other))
    said = driver.get_log("browser")
    check("the console has no line", not said, str(said))


def main():
    folder = tempfile.mkdtemp()
    try:
        make_shot(folder)
        subprocess.run([FATHOM, "report", "z.####.pfm", "--log", "run.jsonl", "-o", "report.html"], cwd=folder,
                       check=True)
        page = f"file://{folder}/report.html"
        driver = browser()
        try:
            for width, height in ((1280, 900), (390, 844)):
                for scheme in (LIGHT, DARK):
                    screen(driver, width, height, scheme[0])
                    driver.get(page)
                    time.sleep(0.2)
                    check_looks(driver, width, scheme)
                    if scheme is LIGHT:
                        for frame in (0, FRAMES - 1):
                            driver.execute_script("const f = document.getElementById('frame'); f.value = arguments[0];"
                                                  "f.dispatchEvent(new Event('input'))", frame)
                            for value in (50, 20, 75):
                                driver.execute_script(
                                    "const c = document.getElementById('compare'); c.value = arguments[0];"
                                    "c.dispatchEvent(new Event('input'))", value)
                                check_handle(driver, f"{width} px, frame {frame + 1}, handle at {value} %", frame)
                        check_pointer(driver)
                        check_keys(driver)
                    text = driver.find_element(By.TAG_NAME, "body").text
                    check("a warning is shown as it is", "</script><b>mind</b>" in text)
                    check("the command is shown", "fathom linearize 'shot.####.pfm' -o 'z.####.pfm'" in text)
            check_requests(driver, page)
        finally:
            driver.quit()
    finally:
        shutil.rmtree(folder)
    print(f"{checks} checks of the page in Chromium, {len(failures)} failed")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
