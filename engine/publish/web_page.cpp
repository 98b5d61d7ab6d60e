// SPDX-License-Identifier: MIT
#include "engine/publish/web_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "engine/core/count_text.h"
#include "engine/core/error.h"
#include "engine/core/text.h"
#include "engine/data/camera_list.h"
#include "engine/data/image_io.h"
#include "engine/data/metrics.h"
#include "engine/publish/page_document.h"
#include "engine/publish/page_splats.h"
#include "engine/render/renderer.h"
#include "engine/report/html.h"
#include "engine/scene/camera.h"
#include "engine/scene/panorama.h"
#include "engine/scene/splat_model.h"
#include "engine/scene/subject.h"

namespace darb {

namespace {

constexpr int kPosterWidth = 800, kPosterQuality = 75;                 // px, of 100
constexpr int kPanoramaWidth = 2048;                                   // px
constexpr int kOrbitViews = 8, kOrbitWidth = 960, kOrbitHeight = 720;  // px

std::vector<View> bookmarks_of(const WebPageOptions& options, const SplatModel& model,
                               const glm::dvec3& up) {
    std::vector<View> views = options.views;
    if (views.empty())
        for (const Camera& camera :
             orbit_cameras(dense_bounds(model), kOrbitViews, kOrbitWidth, kOrbitHeight, up)) {
            views.emplace_back().camera = camera;
            views.back().name = fmt::format("View {}", views.size());
        }
    for (View& view : views) view.camera.lens = {};
    return views;
}

std::size_t start_of(const std::string& start, const std::vector<View>& views) {
    if (start.empty()) return 0;
    const auto named = std::ranges::find(views, start, &View::name);
    if (named != views.end()) return static_cast<std::size_t>(named - views.begin());
    std::size_t number = 0;
    const char* end = start.data() + start.size();
    if (std::from_chars(start.data(), end, number).ptr != end || number < 1 ||
        number > views.size())
        throw Error("--start-camera " + printable(start),
                    fmt::format("is not one of the {} cameras", views.size()),
                    fmt::format("Give a name, such as {}, or a number from 1 to {}.",
                                printable(views[0].name), views.size()));
    return number - 1;
}

Camera at_most(const Camera& camera, int width) {
    if (camera.width <= width) return camera;
    const double share = double(width) / camera.width;
    return resized(camera, width,
                   std::max(1, static_cast<int>(std::lround(camera.height * share))));
}

std::string facts_text(const SplatModel& model, const WebPageFacts& facts) {
    std::string kernel(kernel_name(model.kernel));
    std::ranges::replace(kernel, '_', ' ');
    return fmt::format(
        "{} splats, kernel {} ({}), harmonics of degree {}. {} Made with darb {}.",
        format_number(static_cast<double>(facts.splats)), kernel, footprint_name(model.footprint),
        model.sh_degree,
        facts.merged_from > 0 ? fmt::format("Merged from {}: {:.1f} dB from the source at worst.",
                                            format_number(static_cast<double>(facts.merged_from)),
                                            facts.loss.worst_db)
        : facts.exact         ? std::string("Values as in the file.")
                      : fmt::format("Values are rounded: {:.1f} dB from the source at worst.",
                                    facts.loss.worst_db),
        DARB_VERSION);
}

std::vector<std::byte> poster_of(Device& device, const SplatModel& model,
                                 const PageDocument& document) {
    Renderer renderer(device, model);
    const Camera camera = at_most(document.views[document.start].camera, kPosterWidth);
    return encode_jpeg(to_8bit(renderer.render(camera, document.background)), kPosterQuality);
}

/// From where the first camera stands, upright, with what it looks at in the middle.
PagePanorama panorama_of(Device& device, const SplatModel& model, const PageDocument& document) {
    Camera pose = document.views[document.start].camera;
    const glm::dvec3 centre = pose.centre(), down = -glm::normalize(document.up);
    const glm::dmat3 rows = glm::transpose(pose.rotation);
    glm::dvec3 ahead = rows[2] - down * glm::dot(rows[2], down);
    if (glm::length(ahead) < 1e-3) ahead = rows[1] - down * glm::dot(rows[1], down);
    ahead = glm::normalize(ahead);
    pose.rotation = glm::transpose(glm::dmat3(glm::cross(down, ahead), down, ahead));
    pose.translation = -(pose.rotation * centre);
    Renderer renderer(device, model);
    std::array<ImageF, kCubeFaces> faces;
    for (std::size_t f = 0; f < faces.size(); ++f)
        faces[f] = renderer.render(
            face_camera(pose, cube_faces()[f], face_size(kPanoramaWidth), kJoinMargin),
            document.background);
    const ImageF joined = join_faces(faces, kPanoramaWidth, kPanoramaWidth / 2);
    return {encode_jpeg(to_8bit(joined), kPosterQuality), pose.rotation};
}

/// The page with the splats that were packed last.
class FittedPage : public PictureOutput {
  public:
    FittedPage(Device& device, const SplatModel& source, PageDocument& document)
        : device_(device), source_(source), document_(document) {}

    SplatModel pack(const SplatModel& splats, int level) override {
        const PagePrecision precision = page_precision(level, source_.kernel);
        packed_ = pack_page_splats(splats, precision);
        if (packed_.count == 0)
            throw Error("web page", "the scene has no visible splat",
                        "Choose another scene, or another part of it.");
        facts_.splats = packed_.count;
        facts_.exact = precision.exact;
        return unpack_page_splats(packed_, splats);
    }

    std::size_t finish(const PictureFit& fit) override {
        facts_.merged_from = fit.merged_from;
        facts_.level = fit.level;
        facts_.loss = fit.loss;
        const SplatModel shown = unpack_page_splats(packed_, source_);
        document_.poster = poster_of(device_, shown, document_);
        document_.facts = facts_text(source_, facts_);
        page_ = page_document(document_, shown, packed_);
        facts_.bytes = page_.size();
        return page_.size();
    }

    std::size_t fixed_bytes() const override { return page_.find(kFirstPart); }

    std::string take_page() { return std::move(page_); }
    const WebPageFacts& facts() const { return facts_; }

  private:
    Device& device_;
    const SplatModel& source_;
    PageDocument& document_;
    PageSplats packed_;
    std::string page_;
    WebPageFacts facts_;
};

/// What pages of every kind have of a scene: all but facts and poster.
PageDocument document_of(const SplatModel& model, const WebPageOptions& options) {
    if (model.size() == 0)
        throw Error("web page", "the scene has no splats", "Choose another scene.");
    PageDocument document;
    document.title = options.title;
    document.background = options.background;
    document.up = options.up ? *options.up
                  : options.views.empty()
                      ? guess_up(model)
                      : up_of_cameras(cameras_of(options.views)).value_or(glm::dvec3(0, -1, 0));
    document.views = bookmarks_of(options, model, document.up);
    document.start = start_of(options.start, document.views);
    document.notes = options.notes;
    document.collider = options.collider;
    return document;
}

}  // namespace

std::string make_web_page(Device& device, const SplatModel& model, const WebPageOptions& options,
                          WebPageFacts* facts) {
    PageDocument document = document_of(model, options);
    if (options.panorama) document.panorama = panorama_of(device, model, document);
    const PictureMeasure measure(device, model, document.views, options.background,
                                 options.progress);
    FittedPage page(device, model, document);
    fit_pictures(model, &measure,
                 {kPageLevels + 1, options.exact ? kPageLevels : 0, options.max_bytes}, page);
    if (facts) {
        *facts = page.facts();
        facts->script_bytes = page_script_bytes();
    }
    return page.take_page();
}

std::string make_streamed_page(Device& device, const SplatModel& model, SplatModel stored,
                               std::size_t levels, const WebPageOptions& options,
                               WebPageFacts* facts) {
    if (options.exact || options.max_bytes > 0)
        throw Error("web page", "values and sizes of a streamed scene are those of SOG",
                    "Write one file, which ends in .html, or leave the option out.");
    if (!model.shape.empty())
        throw Error("web page",
                    fmt::format("SOG cannot store the shape that each splat of the kernel {} has",
                                kernel_name(model.kernel)),
                    "Write one file, which ends in .html, or add --kernel gaussian.");
    PageDocument document = document_of(model, options);
    stored.kernel = model.kernel;
    stored.footprint = model.footprint;
    WebPageFacts found;
    found.splats = stored.size();
    found.loss = PictureMeasure(device, model, document.views, options.background, options.progress)
                     .compare(stored);
    document.facts = fmt::format("{} Streamed in {} levels.", facts_text(model, found), levels);
    document.poster = poster_of(device, stored, document);
    if (options.panorama) document.panorama = panorama_of(device, stored, document);
    const std::string page = streamed_page_document(document, model);
    found.bytes = page.size();
    found.script_bytes = most_page_script_bytes();
    if (facts) *facts = found;
    return page;
}

std::string web_page_text(const WebPageFacts& facts) {
    const std::string splats =
        facts.exact ? std::string("float32 values")
                    : fmt::format("values rounded at level {} of {}", facts.level, kPageLevels - 1);
    const std::string merged =
        facts.merged_from > 0 ? " merged from " + count_text(facts.merged_from) : "";
    return fmt::format("{} splats{}, {} bytes, {}: {}", count_text(facts.splats), merged,
                       count_text(facts.bytes), splats, loss_text(facts.loss));
}

}  // namespace darb
