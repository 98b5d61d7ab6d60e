// darb render without cameras: frames along a camera path of the viewer, or once around the scene,
// and a video of them.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <optional>
#include <string>

#include "engine/scene/stored_units.h"
#include "tools/darb/accuracy_flags.h"
#include "tools/darb/depth_file.h"
#include "tools/darb/kernel_flags.h"
#include "tools/darb/tune_flags.h"

namespace darb {

struct FilmFlags {
    std::filesystem::path path, around;
    std::string size, up;  // size: empty where not given
    int fps = 0;           // 0: not given
    double seconds = 6;    // of a turn
};

struct RenderFlags {
    std::filesystem::path scene, cameras, output;
    std::string device;
    bool white_background = false, quiet = false, force = false;
    std::optional<float> near_plane;  // world units
    std::string effects = "auto";
    FilmFlags film;
    DepthFlags depth;
    DatasetOptions data;
    KernelFlags kernel;
    AccuracyFlags accuracy;
    TuneFlags tune;
    StoredUnits units;
};

/// cameras: the option that they stand against.
void add_film_flags(CLI::App& command, FilmFlags& flags, CLI::Option* cameras);
/// Returns the exit code. Throws Error.
int render_film(const RenderFlags& flags, const Accuracy& accuracy, const EffectChoice& choice);

}  // namespace darb
