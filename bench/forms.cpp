// The kernels that decode depth, built for more than the camera needs.
//   z = 1/(m·q)  =  (0, 0, 0, 1)·q / (m·q),     z = n·q  =  (n·q) / ((0, 0, 0, 1)·q),     q = (v, x, y, 1)
// A DepthForm has both rows whatever its form, so a wider one is the same constants under another name.

#include "forms.hpp"

#include "camera/eye_rays.hpp"
#include "operations/parameters.hpp"

namespace fathom::bench {
namespace {

bool has_pixel(const DepthForm& form) {
    const auto depends = [](const Affine& row) { return row[1] != 0 || row[2] != 0; };
    return depends(form.numerator) || depends(form.denominator);
}

std::string name_of(const DepthForm& form, const Rays& rays, bool pixel_terms) {
    const char* where = pixel_terms ? " with x and y" : "";
    switch (form.form) {
    case Form::reciprocal:
        return "1/z from the far end";
    case Form::reciprocal_affine:
        return std::string("1/z affine") + where;
    case Form::affine:
        return std::string("z affine") + where;
    case Form::rational:
        return std::string("quotient") + where;
    case Form::exponential:
        return "exponential";
    default:
        return rays.w_is_depth ? "ray distance" : "ray distance, each ray's depth";
    }
}

// Forms that this one is a case of, itself first.
std::vector<Form> forms_above(Form form) {
    switch (form) {
    case Form::reciprocal:
        return {form, Form::reciprocal_affine, Form::rational};
    case Form::reciprocal_affine:
    case Form::affine:
        return {form, Form::rational};
    default:
        return {form};
    }
}

bool knows_pixel_terms(Form form) {
    return form == Form::reciprocal_affine || form == Form::affine || form == Form::rational;
}

struct Launch {
    runtime::Kernel& kernel;
    runtime::Range range;
    params::grid_params grid;
    params::depth_params depth;
    params::ray_params rays;
};

Launch prepared(const char* kernel, const Model& model, const StoredDepth& stored, const Image& result, bool stream,
                const runtime::Defines& more = {}) {
    const Device& device = result.device();
    const Arithmetic arithmetic = device.options().arithmetic;
    const int vector_width = vector_width_for(device, result.width());
    runtime::Defines choices = decoder_defines(model.form, model.rays, stored.storage, vector_width,
                                               stream && worth_streaming(result, vector_width));
    for (auto& [choice, value] : choices) {
        if (choice == std::string("PIXEL_TERMS"))
            value = model.pixel_terms;
    }
    choices.insert(choices.end(), more.begin(), more.end());
    return {runtime::kernel(device, kernel, choices),
            {static_cast<std::size_t>((result.width() + vector_width - 1) / vector_width),
             static_cast<std::size_t>(result.height())},
            grid_parameters(stored, result, 0, result.width()),
            depth_parameters(model.form, stored.storage, Background::decode, arithmetic),
            ray_parameters(model.rays, model.form.scale, arithmetic)};
}

// c = (k n' - g m)·q / (n'·q) with n' = n - lens m, or ((g n - k m)·q) / (m·q) under an orthographic projection, be the divisor constant.
void set_quotient(params::circle_params& p, const DepthForm& form, const CircleOfConfusion& circle,
                  Arithmetic arithmetic) {
    for (std::size_t i = 0; i < 4; ++i) {
        const long double n = form.numerator[i], m = form.denominator[i], from_lens = n - circle.lens_depth * m;
        const long double above =
            circle.telecentric ? circle.g * n - circle.k * m : circle.k * from_lens - circle.g * m;
        p.numerator[i] = pack_wide(above, arithmetic);
        p.denominator[i] = pack_wide(circle.telecentric ? m : from_lens, arithmetic);
        p.in_front[i] = pack_wide(m, arithmetic);
    }
}

const char* name_of(CircleForm form) {
    switch (form) {
    case CircleForm::recentred:
        return "c from the far end";
    case CircleForm::sum:
        return "c affine";
    case CircleForm::quotient:
        return "c a quotient";
    default:
        return "c of the decoded depth";
    }
}

} // namespace

Model least_model(const Camera& camera, Storage storage) {
    const DepthForm form = depth_form(camera, storage);
    const Rays view = camera_rays(camera);
    return {name_of(form, view, has_pixel(form)), form, view, has_pixel(form)};
}

std::vector<Model> wider_models(const Model& least) {
    std::vector<Model> models;
    for (const Form form : forms_above(least.form.form)) {
        for (const bool pixel_terms : {false, true}) {
            const bool same = form == least.form.form && pixel_terms == least.pixel_terms;
            if (same || pixel_terms < least.pixel_terms || (pixel_terms && !knows_pixel_terms(form)))
                continue;
            Model wider = least;
            wider.form.form = form;
            wider.pixel_terms = pixel_terms;
            wider.name = name_of(wider.form, wider.rays, pixel_terms);
            models.push_back(wider);
        }
    }
    if (least.form.form == Form::ray_distance && least.rays.w_is_depth) {
        Model wider = least;
        wider.rays.w_is_depth = false;
        wider.name = name_of(wider.form, wider.rays, false);
        models.push_back(wider);
    }
    return models;
}

Model with_depth_of_each_ray(Model model) {
    const EyeRays eye = eye_rays(model.rays);
    model.rays = {.origin = eye.origin,
                  .direction = eye.direction,
                  .w_is_depth = false,
                  .depth = eye.depth,
                  .eye_depth = eye.eye_depth};
    model.name += ", each ray's depth";
    return model;
}

void linearize_as(const Model& model, const StoredDepth& stored, const Image& view_depth) {
    const Launch l = prepared("linearize", model, stored, view_depth, true);
    runtime::launch(view_depth.device(), l.kernel, l.range, stored.image, view_depth, l.grid, l.depth, l.rays);
}

void unproject_as(const Model& model, const StoredDepth& stored, const Image& positions) {
    const Launch l = prepared("unproject", model, stored, positions, true, {{"CHANNELS", 3}});
    runtime::launch(positions.device(), l.kernel, l.range, stored.image, positions, l.grid, l.depth, l.rays, l.rays);
}

void inverse_depth_as(const Model& model, const StoredDepth& stored, const Image& inverse_depth) {
    const Launch l =
        prepared("inverse_depth", model, stored, inverse_depth, false, {{"PERSPECTIVE", model.form.perspective}});
    runtime::launch(inverse_depth.device(), l.kernel, l.range, stored.image, inverse_depth, l.grid, l.depth, l.rays);
}

std::vector<CircleModel> circle_models(const Camera& camera, const CircleOfConfusion& circle) {
    const Model depth = least_model(camera);
    std::vector<CircleModel> models;
    for (const CircleForm form : {CircleForm::recentred, CircleForm::sum, CircleForm::quotient, CircleForm::of_depth}) {
        if (form >= circle_form(depth.form, circle))
            models.push_back({name_of(form), depth, form});
    }
    return models;
}

void circle_as(const CircleModel& model, const CircleOfConfusion& circle, const StoredDepth& stored,
               const Image& result) {
    const Device& device = result.device();
    const Arithmetic arithmetic = device.options().arithmetic;
    const runtime::Defines choices{
        {"CIRCLE", static_cast<int>(model.form)}, {"TELECENTRIC", circle.telecentric}, {"WEIGHTS", 0}};
    Model depth = model.depth;
    if (model.form == CircleForm::sum && depth.form.form == Form::reciprocal)
        depth.form.form = Form::reciprocal_affine;
    params::circle_params p = circle_parameters(depth.form, {.circle = circle, .sky = Sky::blur}, arithmetic);
    if (model.form == CircleForm::quotient)
        set_quotient(p, depth.form, circle, arithmetic);
    const Launch l = prepared("dof_masks", model.depth, stored, result, true, choices);
    runtime::launch(device, l.kernel, l.range, stored.image, result, l.grid, l.depth, l.rays, p);
}

} // namespace fathom::bench
