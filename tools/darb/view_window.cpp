#include "tools/darb/view_window.h"

#include <atomic>

#include "engine/core/error.h"
#include "engine/core/say.h"
#include "engine/gpu/device_environment.h"
#include "engine/scene/splat_file.h"
#include "tools/darb/stop_signals.h"
#include "tools/darb/view_times.h"
#include "viewer/display_loss.h"
#include "viewer/recovery.h"
#include "viewer/window.h"

namespace darb {

namespace {

constexpr double kSignalNap_s = 0.2;  // between looks for signals and for the end of the display

// What is not saved stays, where the window ends by itself.
int show_until_closed(ViewerWindow& window, const std::atomic<bool>& lost) {
    const std::atomic<bool>& stop = stop_on_signals();
    const auto recovered = [&](const std::string& hint) {
        const std::string kept = recover_unsaved(window.viewer().session());
        return (hint.empty() ? "" : hint + "\n  ") +
               (kept.empty() ? "There were no changes to save." : kept);
    };
    try {
        while (!stop && window.pump(kSignalNap_s))
            if (lost) throw Error("window", "the display is gone");
    } catch (const std::exception& e) {  // memory that runs out, too
        if (lost) throw Error("window", "the display is gone", recovered(""));
        const auto* known = dynamic_cast<const Error*>(&e);
        throw known != nullptr ? Error(known->where, known->reason, recovered(known->hint))
                               : Error("window", e.what(), recovered(""));
    }
    if (stop) say("interrupted by {}\n  {}\n", stop_name(), recovered(""));
    return stop ? stop_exit_code() : 0;
}

}  // namespace

int view_in_window(const ViewFlags& flags, const ViewerOptions& options, const PixelSize& size,
                   const std::string& note) {
    std::atomic<bool> lost{false};  // the display; before what it outlives
    const WindowSystem windows;
    survive_display_loss(lost);
    DeviceOptions device_options = command_device(flags.device);
    windows.require(device_options);
    Device device(device_options);
    settle_tuning(device, flags.tune);
    ViewerWindow window(device, options, size.width, size.height);
    apply_flags(window.viewer(), flags, size);
    if (!note.empty()) window.viewer().session().tell(note);
    if (!flags.scene.empty()) {
        window.viewer().open(flags.scene);
        window.set_title(scene_name(flags.scene, true) + " - darb");
    }
    if (flags.times.empty()) return show_until_closed(window, lost);
    write_view_times(window, device, lost, flags.times);
    return 0;
}

}  // namespace darb
