// SPDX-License-Identifier: MIT
#include "tools/python/trainer.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "engine/plan/tuner.h"
#include "engine/raster/frame_view.h"
#include "engine/scene/edit_splats.h"
#include "tools/python/scene.h"
#include "tools/python/train_options.h"
#include "trainer/options/schedule.h"
#include "trainer/run/forecast.h"
#include "trainer/run/run.h"
#include "trainer/run/run_report.h"
#include "trainer/step/checkpoint.h"

namespace darb::python {

namespace {

// The options name the lens and size only for a path; a data set keeps those with which it was
// read.
Dataset take_dataset(const py::object& given, const py::dict& options,
                     const TrainRequest& request) {
    Dataset dataset;
    if (py::isinstance<PyDataset>(given)) {
        for (const char* name : {"resolution", "r", "eval", "images", "i", "lens"})
            if (options.contains(name))
                throw Error(name, "is given beside a Dataset, which was read with its own",
                            "Give it to Dataset.read.");
        dataset = given.cast<const PyDataset&>().data;
    } else {
        const py::gil_scoped_release free;
        dataset = load_dataset(request.dataset, request.data);
    }
    if (!request.points.empty()) replace_points(request.points, dataset);
    if (!dataset.options.hold_out)
        for (View& view : dataset.views) view.is_test = false;
    return dataset;
}

py::array picture_array(const ImageF& image) {
    return to_array(image.data, {image.height, image.width, image.channels});
}

// The gradient that a Python loss returns: an array with the picture's shape.
ImageF ask_python(const py::object& loss, const TrainingPicture& picture) {
    const py::gil_scoped_acquire gil;
    py::dict view;
    view["name"] = picture.name;
    view["iteration"] = picture.iteration;
    view["photo"] = to_array(picture.photo.data, {picture.photo.height, picture.photo.width, 4});
    view["background"] = to_array(
        std::vector<float>{picture.background.r, picture.background.g, picture.background.b}, {3});
    const ImageF& image = picture.image;
    const py::object answer = loss(picture_array(image), view);
    const Floats d = take_floats(answer, "the loss's gradient", {image.height, image.width, 3});
    ImageF result(image.width, image.height, 3);
    std::copy_n(d.data, d.size(), result.data.begin());
    return result;
}

// Marks the device while a step runs: callbacks may draw, but not train.
class Training {
  public:
    explicit Training(PyDevice& device) : device_(device) {
        if (device_.training)
            throw Error("darb.Trainer", "a step is under way on this device",
                        "Train after the callback has returned.");
        device_.training = true;
    }
    ~Training() { device_.training = false; }
    Training(const Training&) = delete;
    Training& operator=(const Training&) = delete;

  private:
    PyDevice& device_;
};

}  // namespace

PyTrainer::PyTrainer(std::shared_ptr<PyDevice> device, const py::object& dataset,
                     const py::dict& options)
    : device_(std::move(device)) {
    const bool is_read = py::isinstance<PyDataset>(dataset);
    job_.request = take_train_options(options, is_read ? "" : take_path(dataset, "dataset"));
    job_.dataset = take_dataset(dataset, options, job_.request);
    const py::gil_scoped_release free;
    const auto lock = device_->lock();
    const Training training(*device_);
    try {
        make_trainer();
    } catch (...) {
        trainer_.reset();  // destroyed under the lock
        if (job_.options.max_memory_bytes) device_->device().set_memory_budget(0);
        throw;
    }
}

void PyTrainer::make_trainer() {
    Device& device = device_->device();
    for (const View& view : job_.dataset.views)
        check_frame(device, view.camera.width, view.camera.height, view.name);
    job_ = resolve(std::move(job_.request), std::move(job_.dataset));
    find_start(device, job_);
    job_.start.reset();  // its pictures are only for a run's folder
    check_signals();
    photos_ = photos_of_run(job_.dataset, job_.options, std::move(job_.photos));
    check_signals();
    const Schedule schedule(job_.options);
    std::optional<Checkpoint> start;
    if (!job_.resume_from.empty()) {
        start = read_checkpoint(job_.resume_from);
        check_resumable(*start, job_.resume_from, schedule, job_.dataset, fingerprint());
        device.set_tuning(resumed_tuning(device.info(), device.tuning(), start->tuning,
                                         job_.resume_from.string()));
    } else {
        check_start_memory(device, job_.dataset, schedule);
    }
    trainer_ = std::make_unique<Trainer>(device, job_.dataset, photos_,
                                         first_model(job_.dataset, schedule, start), schedule);
    trainer_->on_result = [this](const IterationResult& result) { latest_ = result; };
    trainer_->on_round = [this](int iteration, const DensityResult& result) {
        tell_round(iteration, result);
    };
    if (!start) return;
    trainer_->restore(start->state);
    seconds_ = start->seconds;
}

PyTrainer::~PyTrainer() {
    const py::gil_scoped_release free;
    device_->let_go(
        [this] {
            trainer_.reset();
            if (job_.options.max_memory_bytes) device_->device().set_memory_budget(0);
        },
        [this] { static_cast<void>(trainer_.release()); });
}

void PyTrainer::tell_round(int iteration, const DensityResult& result) {
    const py::gil_scoped_acquire gil;
    if (on_round.is_none()) return;
    py::dict d;
    d["iteration"] = iteration;
    d["before"] = result.before;
    d["after"] = result.after;
    d["grown"] = result.grown;
    d["pruned"] = result.pruned;
    on_round(d);
}

py::dict PyTrainer::step(const py::object& n, const py::object& loss) {
    const auto count = take_integer(n, "n", 0, 1'000'000'000);
    take_callable(loss, "loss");
    {
        const py::gil_scoped_release free;
        const auto lock = device_->lock();
        const Training training(*device_);
        if (!loss.is_none())
            trainer_->set_picture_gradient(
                [&loss](const TrainingPicture& picture) { return ask_python(loss, picture); });
        const auto begin = std::chrono::steady_clock::now();
        const auto end = [&] {
            trainer_->drain();
            trainer_->set_picture_gradient(nullptr);
            seconds_ +=
                std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
        };
        try {
            const auto last = std::min<long long>(iteration() + count, iterations());
            while (iteration() < last) {
                check_signals();
                trainer_->step();
            }
        } catch (...) {
            end();
            throw;
        }
        end();
    }
    py::dict d;
    d["iteration"] = iteration();
    d["loss"] = latest_.loss;
    d["psnr"] = latest_.psnr_db;
    d["splats"] = splats();
    d["visible"] = latest_.visible;
    d["intersections"] = latest_.intersections;
    d["done"] = iteration() >= iterations();
    return d;
}

py::dict PyTrainer::evaluate() {
    Evaluation evaluation;
    {
        const py::gil_scoped_release free;
        const auto lock = device_->lock();
        const Training training(*device_);
        for (std::size_t i = 0; i < job_.dataset.views.size(); ++i) {
            const View& view = job_.dataset.views[i];
            if (!view.is_test) continue;
            check_signals();
            evaluation.views.push_back(compare_view(view.name, trainer_->render(view.camera),
                                                    photos_[i], trainer_->background(),
                                                    job_.dataset.alpha_is_mask));
            evaluation.views.back().in_arc = view.in_arc;
        }
        if (evaluation.views.empty())
            throw Error("darb.Trainer", "no view is held out",
                        "Make it with eval=True, or read the Dataset so.");
        take_means(evaluation);
    }
    py::list views;
    for (const ViewMetrics& v : evaluation.views) {
        py::dict one;
        one["name"] = v.name;
        one["psnr"] = v.psnr_db;
        one["ssim"] = v.ssim;
        views.append(one);
    }
    py::dict d;
    d["iteration"] = iteration();
    d["psnr"] = evaluation.psnr_db;
    d["ssim"] = evaluation.ssim;
    d["splats"] = splats();
    d["views"] = views;
    return d;
}

SplatModel PyTrainer::model() {
    const py::gil_scoped_release free;
    const auto lock = device_->lock();
    const Training training(*device_);
    SplatModel model = trainer_->model();
    drop_non_finite(model);
    drop_undrawn(trainer_->schedule().undrawn_opacity, 0, model);  // as the command saves it
    return model;
}

const std::string& PyTrainer::fingerprint() {
    if (fingerprint_.empty()) fingerprint_ = dataset_fingerprint(job_.dataset, photos_);
    return fingerprint_;
}

void PyTrainer::checkpoint(const py::object& value) {
    const std::string path = take_path(value, "path");
    const py::gil_scoped_release free;
    const auto lock = device_->lock();
    const Training training(*device_);
    write_checkpoint(path, {trainer_->state(), settings_text(job_.options), fingerprint(), seconds_,
                            result_tuning(device_->device())});
}

void bind_trainer(py::module_& module) {
    py::class_<PyTrainer>(module, "Trainer", "`darb train` step by step; see darb.Trainer.")
        .def(py::init<std::shared_ptr<PyDevice>, const py::object&, const py::dict&>())
        .def("step", &PyTrainer::step, py::arg("n") = 1, py::arg("loss") = py::none(),
             "n iterations, fewer where the run ends; a dict of the last one. See darb.Trainer.")
        .def("evaluate", &PyTrainer::evaluate,
             "A dict of psnr (dB), ssim and views, over the views that are held out.")
        .def(
            "scene", [](PyTrainer& t) { return PyScene(t.model()); },
            "The splats of now as a Scene.")
        .def("checkpoint", &PyTrainer::checkpoint, py::arg("path"),
             "Writes all that start_checkpoint= needs to go on bit by bit.")
        .def_property(
            "on_round", [](const PyTrainer& t) { return t.on_round; },
            [](PyTrainer& t, const py::object& f) { t.on_round = take_callable(f, "on_round"); },
            "A function of a dict, called after each round of density control, or None.")
        .def_property_readonly("iteration", &PyTrainer::iteration, "Iterations done.")
        .def_property_readonly("iterations", &PyTrainer::iterations, "Iterations of the whole run.")
        .def_property_readonly(
            "options", [](const PyTrainer& t) { return asked_options(t.request()); },
            "A dict of every option by name, as it was asked for or by default.")
        .def("__len__", &PyTrainer::splats);
}

}  // namespace darb::python
