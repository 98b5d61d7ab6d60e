#include "viewer/warm_up.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "engine/scene/edit_splats.h"
#include "viewer/splat_picture.h"

namespace darb {

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
               displays = std::move(displays), camera,
               wake = std::move(wake)](const std::stop_token& stop) {
          run(stop, window, options, few, displays, camera);
          done_ = true;
          if (wake) wake();
      }) {}

void WarmUp::run(const std::stop_token& stop, Device& window, const DeviceOptions& options,
                 const SplatModel& few, const std::vector<DisplaySettings>& displays,
                 const Camera& camera) {
    try {
        Device device(options);
        device.set_tuning(window.tuning());
        SplatPicture picture(device);
        std::vector<std::uint32_t> important(few.size() / 2);
        std::iota(important.begin(), important.end(), 0u);
        picture.set_scene(few, scene_bounds(few), std::move(important));
        for (std::size_t i = 0; i < displays.size(); ++i)
            for (const bool moves : {false, true})
                if (!stop.stop_requested())
                    picture.render(camera, displays[i], {},
                                   moves ? std::optional(picture.most_moving()) : std::nullopt,
                                   static_cast<int>(i));
        for (const PipelineKey& key : live_pipelines(device))
            if (!stop.stop_requested()) made_.emplace_back(window, key);
    } catch (const std::exception&) {  // the window says what is wrong, where it is
    }
}

}  // namespace darb
