// SPDX-License-Identifier: MIT
#include "viewer/picture_work.h"

#include <fmt/format.h>
#include <algorithm>
#include <numeric>
#include <utility>

#include "engine/data/metrics.h"
#include "engine/scene/edit_splats.h"
#include "viewer/splat_picture.h"
#include "viewer/switches.h"

namespace darb {

AccuracyMeasure::AccuracyMeasure(const Camera& camera, const DisplaySettings& display,
                                 const DisplaySettings& own)
    : camera_(camera) {
    DisplaySettings now = display;
    now.mode = VIEW_COLOUR;
    now.style = SplatStyle::splats;
    now.mesh = MeshShow::none;
    DisplaySettings exact = now;
    choose(kPresetRow, kExact, exact);
    exact.footprint = own.footprint;
    exact.sh_degree = own.sh_degree;
    exact.effects = own.effects;
    exact.huge_splat_path = own.huge_splat_path;
    pictures_ = {{exact, {}}, {now, {}}};
    const auto add = [&](int row) {
        const int count = static_cast<int>(row_choices(row, own.sh_degree).size());
        for (int choice = 0; choice < count; ++choice) {
            DisplaySettings changed = now;
            choose(row, choice, changed);
            if (!(changed == now)) pictures_.push_back({changed, {}});
            Picture& picture = changed == now ? pictures_[1] : pictures_.back();
            picture.choices.push_back({row, choice, 0, 0});
        }
    };
    for (const int row : kAccuracyRows) add(row);
    for (const int row : kEffectRows) add(row);
}

void AccuracyMeasure::step(
    const std::function<Frame(const Camera&, const DisplaySettings&)>& render) {
    if (done()) return;
    const Picture& picture = pictures_[next_];
    const Frame frame = render(camera_, picture.display);
    if (next_ == 0) exact_ = to_float(frame.picture);
    const double psnr_db = psnr(to_float(frame.picture), exact_);
    for (MeasuredChoice choice : picture.choices) {
        choice.ms = frame.ms;
        choice.psnr_db = psnr_db;
        results_.push_back(choice);
    }
    ++next_;
}

FreeSpaceSearch::FreeSpaceSearch(Device& device, const SplatModel& model,
                                 const std::vector<Camera>& cameras,
                                 const FreeSpaceOptions& options)
    : cameras_(evenly_chosen(cameras)), renderer_(device, model), space_(model, options) {}

namespace {

// The first timing may include compiling; the smaller of the two others counts.
constexpr int kTimings = 3;

AccuracyMeasure::Frame timed_picture(SplatPicture& picture, const Camera& camera,
                                     const DisplaySettings& display) {
    double ms = 0;
    for (int i = 0; i < kTimings; ++i) {
        picture.render(camera, display, {});
        double sum = 0;
        for (const PassTime& pass : picture.pass_times())
            if (pass.name != "display") sum += pass.ms;
        if (i > 0) ms = i == 1 ? sum : std::min(ms, sum);
    }
    return {read_pixels(picture), ms};
}

}  // namespace

ImageU8 read_pixels(const Buffer& buffer, int width, int height) {
    ImageU8 image(width, height, 3);
    const size_t pixels = size_t(width) * size_t(height);
    const std::vector<std::uint32_t> bgra = buffer.download<std::uint32_t>(pixels);
    for (size_t p = 0; p < pixels; ++p)
        for (size_t c = 0; c < 3; ++c)
            image.data[3 * p + c] = static_cast<std::uint8_t>(bgra[p] >> (16 - 8 * c));
    return image;
}

ImageU8 read_pixels(const SplatPicture& picture) {
    return read_pixels(picture.pixels(), picture.width(), picture.height());
}

void PictureWork::start_export(const CameraPath& path, const ExportOptions& options) {
    export_.reset();  // it may be writing the same video
    export_.emplace(path, options);
}

void PictureWork::start_measure(const Camera& camera, const DisplaySettings& display,
                                const DisplaySettings& own) {
    measure_.emplace(camera, display, own);
}

void PictureWork::start_search(Device& device, const SplatModel& model,
                               const std::vector<Camera>& cameras,
                               const FreeSpaceOptions& options) {
    search_ = std::make_unique<FreeSpaceSearch>(device, model, cameras, options);
}

void PictureWork::start_mesh(MeshJob::Work work, std::function<void()> wake) {
    cancel_mesh();
    mesh_ = std::make_unique<MeshJob>(std::move(work), std::move(wake));
}

// The thread ends at its next report of progress; nobody waits for that.
void PictureWork::cancel_mesh() {
    std::erase_if(ended_, [](const auto& job) { return job->done(); });
    if (!mesh_) return;
    mesh_->cancel();
    ended_.push_back(std::move(mesh_));
}

std::optional<ShownMesh> PictureWork::take_mesh(bool wait) {
    if (!mesh_) return {};
    if (wait) mesh_->wait();
    if (!mesh_->done()) return {};
    return std::exchange(mesh_, nullptr)->take();
}

void PictureWork::cancel() {
    cancel_mesh();
    export_.reset();
    measure_.reset();
    search_.reset();
}

std::string PictureWork::lose_scene(const char* why) {
    measure_.reset();
    search_.reset();
    if (!export_ || export_->has_frames()) return "";
    const std::string note = fmt::format("the export ended after {} of {} frames: {}",
                                         export_->written(), export_->frame_count(), why);
    export_.reset();
    return note;
}

std::optional<std::string> PictureWork::step_export(SplatPicture& picture, bool wait) {
    try {
        export_->step(
            [&](const Camera& camera, const DisplaySettings& display) {
                picture.render(camera, display, {});
                return read_pixels(picture);
            },
            wait);
    } catch (...) {
        export_.reset();
        throw;
    }
    if (!export_->done()) return {};
    const std::string summary = export_->summary();
    export_.reset();
    return summary;
}

std::vector<MeasuredChoice> PictureWork::step_measure(SplatPicture& picture) {
    try {
        measure_->step([&](const Camera& camera, const DisplaySettings& display) {
            return timed_picture(picture, camera, display);
        });
    } catch (...) {
        measure_.reset();
        throw;
    }
    std::vector<MeasuredChoice> results = measure_->results();
    if (measure_->done()) measure_.reset();
    return results;
}

std::optional<SplatSet> PictureWork::step_search() {
    try {
        search_->step();
    } catch (...) {
        search_.reset();
        throw;
    }
    if (!search_->done()) return {};
    return std::exchange(search_, nullptr)->splats();
}

namespace {

constexpr std::size_t kFew = 256;

SplatModel few_of(const SplatModel& model) {
    std::vector<std::uint32_t> splats;
    for (std::size_t i = 0; i < std::min(kFew, model.size()); ++i)
        splats.push_back(static_cast<std::uint32_t>(i * model.size() / kFew % model.size()));
    return pick_splats(model, splats);
}

}  // namespace

WarmUp::WarmUp(Device& window, DeviceOptions options, const SplatModel& model,
               std::vector<DisplaySettings> displays, const Camera& camera,
               std::function<void()> wake)
    : thread_([this, &window, options = std::move(options), few = few_of(model),
               displays = std::move(displays), camera, wake = std::move(wake)] {
          run(window, options, few, displays, camera);
          done_ = true;
          if (wake) wake();
      }) {}

void WarmUp::run(Device& window, const DeviceOptions& options, const SplatModel& few,
                 const std::vector<DisplaySettings>& displays, const Camera& camera) {
    try {
        Device device(options);
        device.set_tuning(window.tuning());
        SplatPicture picture(device);
        std::vector<std::uint32_t> important(few.size() / 2);
        std::iota(important.begin(), important.end(), 0u);
        picture.set_scene(few, scene_bounds(few), std::move(important));
        for (std::size_t i = 0; i < displays.size(); ++i)
            for (const bool moves : {false, true})
                if (!stop_)
                    picture.render(camera, displays[i], {},
                                   moves ? std::optional(picture.most_moving()) : std::nullopt,
                                   static_cast<int>(i));
        for (const PipelineKey& key : live_pipelines(device))
            if (!stop_) made_.emplace_back(window, key);
    } catch (const std::exception&) {  // the window reports the error where it matters
    }
}

}  // namespace darb
