#include "engine/publish/web_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "engine/core/error.h"
#include "engine/core/text.h"
#include "engine/data/compare_view.h"
#include "engine/data/image_io.h"
#include "engine/data/metrics.h"
#include "engine/publish/page_document.h"
#include "engine/publish/page_splats.h"
#include "engine/render/renderer.h"
#include "engine/report/html.h"
#include "engine/scene/merge_splats.h"
#include "engine/scene/orbit_cameras.h"
#include "engine/scene/splat_shapes.h"

namespace darb {

namespace {

constexpr std::size_t kMeasuredViews = 8;
constexpr int kMeasuredWidth = 800, kPosterWidth = 800, kPosterQuality = 75;  // px, px, of 100
constexpr int kOrbitViews = 8, kOrbitWidth = 960, kOrbitHeight = 720;         // px
constexpr double kEqualDb = 100;

std::vector<View> bookmarks_of(const WebPageOptions& options, const SplatModel& model) {
    std::vector<View> views = options.views;
    if (views.empty())
        for (const Camera& camera : orbit_cameras(model, kOrbitViews, kOrbitWidth, kOrbitHeight)) {
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
                    fmt::format("is none of the {} cameras", views.size()),
                    fmt::format("Give a name, as {}, or a number from 1 to {}.",
                                printable(views[0].name), views.size()));
    return number - 1;
}

Camera at_most(const Camera& camera, int width) {
    if (camera.width <= width) return camera;
    const double share = double(width) / camera.width;
    return resized(camera, width,
                   std::max(1, static_cast<int>(std::lround(camera.height * share))));
}

/// Pictures of a model, and how near those of other splats come to them.
class Measure {
  public:
    Measure(Device& device, const SplatModel& model, const std::vector<View>& views,
            const glm::vec3& background)
        : device_(device), background_(background) {
        const std::size_t count = std::min(kMeasuredViews, views.size());
        Renderer renderer(device, model);
        for (std::size_t i = 0; i < count; ++i) {
            const View& view = views[i * views.size() / count];
            names_.push_back(view.name);
            cameras_.push_back(at_most(view.camera, kMeasuredWidth));
            truths_.push_back(renderer.render(cameras_.back(), background));
        }
    }

    void compare(const SplatModel& splats, WebPageFacts& facts) const {
        Renderer renderer(device_, splats);
        facts.views = cameras_.size();
        facts.mean_db = 0;
        facts.worst_db = 2 * kEqualDb;
        for (std::size_t i = 0; i < cameras_.size(); ++i) {
            const double db =
                std::min(psnr(renderer.render(cameras_[i], background_), truths_[i]), kEqualDb);
            facts.mean_db += db / static_cast<double>(cameras_.size());
            if (db >= facts.worst_db) continue;
            facts.worst_db = db;
            facts.worst_view = names_[i];
        }
    }

  private:
    Device& device_;
    glm::vec3 background_;
    std::vector<std::string> names_;
    std::vector<Camera> cameras_;
    std::vector<ImageF> truths_;
};

/// The coarsest that is good enough, at best exact.
PageSplats fitting_splats(const SplatModel& model, bool exact, const Measure& measure,
                          WebPageFacts& facts) {
    for (facts.level = exact ? kPageLevels : 0;; ++facts.level) {
        const PagePrecision precision = page_precision(facts.level, model.kernel);
        PageSplats packed = pack_page_splats(model, precision);
        if (packed.count == 0)
            throw Error("web page", "the scene has no splat that is drawn",
                        "Choose another scene, or another part of it.");
        facts.splats = packed.count;
        facts.exact = precision.exact;
        measure.compare(unpack_page_splats(packed, model), facts);
        if (precision.exact || facts.worst_db >= kPageWorstDb) return packed;
    }
}

/// Splats whose page is likely to be no larger, fewer than there are.
std::size_t count_that_fits(std::size_t splats, const std::string& page, std::uint64_t most) {
    const std::size_t head = page.find(kFirstPart);
    const double share = (static_cast<double>(most) - static_cast<double>(head)) /
                         static_cast<double>(page.size() - head);
    const double count = std::floor(0.98 * share * static_cast<double>(splats));
    if (count < 1)
        throw Error("--max-size",
                    fmt::format("{} bytes hold no splats: renderer, cameras and "
                                "picture take {}",
                                most, head),
                    "Give more.");
    return static_cast<std::size_t>(count);
}

std::string facts_text(const SplatModel& model, const WebPageFacts& facts) {
    std::string kernel(kernel_name(model.kernel));
    std::ranges::replace(kernel, '_', ' ');
    return fmt::format(
        "{} splats, kernel {} ({}), harmonics of degree {}. {} Made with darb {}.",
        format_number(static_cast<double>(facts.splats)), kernel, footprint_name(model.footprint),
        model.sh_degree,
        facts.merged_from > 0
            ? fmt::format("Merged from {}: {:.1f} dB from the source at worst.",
                          format_number(static_cast<double>(facts.merged_from)), facts.worst_db)
        : facts.exact ? std::string("Values as in the file.")
                      : fmt::format("Values are rounded: {:.1f} dB from the source at worst.",
                                    facts.worst_db),
        DARB_VERSION);
}

}  // namespace

std::string make_web_page(Device& device, const SplatModel& model, const WebPageOptions& options,
                          WebPageFacts* facts) {
    if (model.size() == 0)
        throw Error("web page", "the scene has no splats", "Choose another scene.");
    if (!model.shape.empty())
        throw Error("web page",
                    fmt::format("has no place for the shape that each splat of the kernel {} has",
                                kernel_name(model.kernel)),
                    "Write the nearest Gaussians: darb convert --kernel gaussian.");
    PageDocument document;
    document.title = options.title;
    document.background = options.background;
    document.views = bookmarks_of(options, model);
    document.start = start_of(options.start, document.views);
    WebPageFacts found;
    const Measure measure(device, model, document.views, options.background);
    PageSplats packed = fitting_splats(model, options.exact, measure, found);
    const auto finish = [&] {
        const SplatModel shown = unpack_page_splats(packed, model);
        Renderer renderer(device, shown);
        const Camera camera = at_most(document.views[document.start].camera, kPosterWidth);
        document.poster =
            encode_jpeg(to_8bit(renderer.render(camera, options.background)), kPosterQuality);
        document.facts = facts_text(model, found);
        return page_document(document, shown, packed);
    };
    std::string page = finish();
    SplatModel kept;
    while (options.max_bytes > 0 && page.size() > options.max_bytes) {
        const SplatModel& from = kept.size() > 0 ? kept : model;
        kept = merge_splats(from, count_that_fits(from.size(), page, options.max_bytes));
        packed = pack_page_splats(kept, page_precision(found.level, model.kernel));
        found.splats = packed.count;
        found.merged_from = model.size();
        measure.compare(unpack_page_splats(packed, kept), found);
        page = finish();
    }
    found.bytes = page.size();
    found.script_bytes = page_script_bytes();
    if (facts) *facts = found;
    return page;
}

std::string web_page_text(const WebPageFacts& facts) {
    const std::string splats =
        facts.exact ? std::string("float32 values")
                    : fmt::format("values rounded at level {} of {}", facts.level, kPageLevels - 1);
    const std::string merged =
        facts.merged_from > 0 ? fmt::format(" merged from {}", facts.merged_from) : "";
    return fmt::format(
        "{} splats{}, {} bytes, {}: {:.2f} dB mean over {} views, {:.2f} dB at worst "
        "({})",
        facts.splats, merged, facts.bytes, splats, facts.mean_db, facts.views, facts.worst_db,
        printable(facts.worst_view));
}

}  // namespace darb
