// SPDX-License-Identifier: MIT
#include "tools/darb/page_output.h"

#include <fmt/format.h>

#include <utility>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/say.h"
#include "engine/core/text.h"
#include "engine/publish/web_page.h"
#include "engine/scene/merge_splats.h"
#include "engine/scene/splat_file.h"
#include "tools/darb/open_cameras.h"
#include "tools/darb/outputs.h"

namespace darb {

namespace {

/// Reads black, white or #rrggbb.
glm::vec3 parse_colour(const std::string& text) {
    if (lower(text) == "black") return glm::vec3(0);
    if (lower(text) == "white") return glm::vec3(1);
    const std::string digits = text.starts_with('#') ? text.substr(1) : std::string();
    if (digits.size() != 6 || digits.find_first_not_of("0123456789abcdefABCDEF") != digits.npos)
        throw Error("--background " + printable(text), "is no colour",
                    "Give black, white or six digits, as '#20304a'.");
    const auto part = [&](std::size_t at) {
        return static_cast<float>(std::stoi(digits.substr(at, 2), nullptr, 16)) / 255;
    };
    return {part(0), part(2), part(4)};
}

}  // namespace

void add_page_options(CLI::App& command, PageFlags& flags) {
    const std::string group = "Web page (.html)";
    command
        .add_flag("--web", flags.web,
                  "write a folder whose page fetches a large scene in parts, for a web server")
        ->group(group);
    command
        .add_option("--title", flags.title, "title of the page (default: the name of the scene)")
        ->group(group);
    command
        .add_option("--start-camera", flags.start_camera,
                    "name or number of the camera at which it opens (default: 1)")
        ->group(group);
    command.add_option("--background", flags.background, "black, white or '#rrggbb'")
        ->capture_default_str()
        ->group(group);
    command
        .add_flag("--exact", flags.exact,
                  "keep float32 values; otherwise they are rounded and the error is printed")
        ->group(group);
}

bool is_page(const std::filesystem::path& output) {
    return has_extension(output, ".html") || has_extension(output, ".htm");
}

void check_page_options(const PageFlags& flags, const std::filesystem::path& output) {
    if (flags.web && flags.exact)
        throw Error("--exact", "is not for --web, whose values are those of SOG",
                    "Leave it out, or write one file that ends in .html.");
    if (is_page(output) || flags.web) return;
    const PageFlags none;
    const char* given = !flags.title.empty()                  ? "--title"
                        : !flags.start_camera.empty()         ? "--start-camera"
                        : flags.background != none.background ? "--background"
                        : flags.exact                         ? "--exact"
                                                              : nullptr;
    if (given) throw Error(given, "is an option of web pages", "Let the output end in .html.");
}

std::vector<View> named_views(const std::filesystem::path& cameras) {
    if (cameras.empty()) return {};
    std::vector<View> views = open_cameras(cameras);
    if (views.empty())
        throw Error(cameras.string(), "holds no cameras", "Name another list or data set.");
    return views;
}

namespace {

constexpr std::size_t kCoarsestSplats = 16 << 10;  // of the level that a page shows first
constexpr std::size_t kWebFileSplats = 64 << 10;

WebPageOptions page_options(const PageFlags& flags, const std::string& title,
                            std::vector<View> views) {
    WebPageOptions options;
    options.title = flags.title.empty() ? title : flags.title;
    options.start = flags.start_camera;
    options.background = parse_colour(flags.background);
    options.exact = flags.exact;
    options.max_bytes = flags.max_bytes;
    options.views = std::move(views);
    options.up = flags.up;
    return options;
}

}  // namespace

std::string write_page(Device& device, const SplatModel& model, const PageFlags& flags,
                       const std::string& title, std::vector<View> views,
                       const std::filesystem::path& output) {
    WebPageOptions options = page_options(flags, title, std::move(views));
    SlowProgress progress("measuring");
    options.progress = [&](std::size_t pictures) { progress.at(pictures, "pictures"); };
    WebPageFacts facts;
    write_file_atomic(output, make_web_page(device, model, options, &facts));
    return fmt::format("{}: {}\n", printable(output.string()), web_page_text(facts));
}

std::vector<std::size_t> web_levels(std::size_t splats) {
    std::vector<std::size_t> counts;
    while (splats > kCoarsestSplats) counts.push_back(splats /= 4);
    return counts;
}

std::string write_web_folder(Device& device, SplatModel& model, const PageFlags& flags,
                             const std::string& title, std::vector<View> views, const WebFolder& to,
                             Paths& written) {
    constexpr SplatFormat kFormat = SplatFormat::streamed_sog;
    const std::filesystem::path lod_meta = to.folder / "lod-meta.json",
                                index = to.folder / "index.html";
    WebPageOptions options = page_options(flags, title, std::move(views));
    SlowProgress merging("merging"), palettes("palettes of harmonics"), pictures("measuring");
    options.progress = [&](std::size_t count) { pictures.at(count, "pictures"); };
    const int kernel = std::exchange(model.kernel, KERNEL_GAUSSIAN);  // the page has its kernel
    const Footprint footprint = std::exchange(model.footprint, Footprint::psi);
    for (const std::string& loss : losses_of(kFormat, model, lod_meta.string()))
        say("warning: {}: {}\n", lod_meta.string(), loss);
    model.kernel = kernel;
    model.footprint = footprint;
    drop_unwritable(kFormat, model);
    EncodeOptions encode;
    encode.file_splats = kWebFileSplats;
    encode.assign_rows = to.assign_rows;
    encode.progress = [&](double share) { palettes.at(share); };
    encode.coarser =
        merge_levels(model, to.counts, {.progress = [&](double share) { merging.at(share); }});
    for (SplatModel& level : encode.coarser) drop_unwritable(kFormat, level);
    const EncodedSplats encoded = encode_scene(kFormat, model, lod_meta.string(), encode);
    written = together({outputs_of(lod_meta, encoded), {index}});
    to.check(written);
    write_encoded(lod_meta, encoded);
    WebPageFacts facts;
    write_file_atomic(index, make_streamed_page(device, model, load_splats(lod_meta),
                                                encode.coarser.size() + 1, options, &facts));
    return fmt::format("{}: {} splats in {} levels and {} files, {} bytes, page of {} bytes: {}\n",
                       printable(index.string()), facts.splats, encode.coarser.size() + 1,
                       written.size(), encoded.bytes(), facts.bytes, loss_text(facts.loss));
}

std::FILE* stream_beside(const std::filesystem::path& output) {
    return std::filesystem::exists(output) && !std::filesystem::is_regular_file(output) ? stderr
                                                                                        : stdout;
}

}  // namespace darb
