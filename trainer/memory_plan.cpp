#include "trainer/memory_plan.h"

#include <algorithm>

#include "shaders/shared/effect_args.h"
#include "shaders/shared/limits.h"
#include "shaders/shared/render_args.h"

namespace darb {

namespace {

constexpr std::uint64_t kFloat = 4;
constexpr std::uint64_t kOtherFloats = 14;  // position 3, scale 3, rotation 4, opacity 1, colour 3

// Shape, light, bound and cover, 16 bytes each; eight words; a key and a value of the depth sort;
// the sums of gradients for density control.
constexpr std::uint64_t kFrameBytes = 4 * 16 + 8 * 4 + 2 * 4 + 2 * 4;
// Tile, splat and order; a key and a value of the tile sort; three partial gradients.
constexpr std::uint64_t kPairBytes = 3 * 4 + 2 * 4 + 3 * 16;
constexpr std::uint64_t kPhotoBytes = 4;  // RGBA
// Picture and its gradient, three planes each; final transmittance and last pair.
constexpr std::uint64_t kImageBytes = 2 * 12 + 2 * 4;
// Five words and two offsets into sources, two words each for up to twice the splats.
constexpr std::uint64_t kDensifyBytes = 5 * 4 + 2 * 2 * 4;
// Exposure: a second picture of three planes; a map and two moments a photo; partial sums.
constexpr std::uint64_t kMappedBytes = 12, kMapBytes = 3 * EXPOSURE_TERMS * 4,
                        kMapPartials = EXPOSURE_MAX_GROUPS * EXPOSURE_TERMS * 4;
// The 3D filter: a deviation a splat, and the cameras a second time.
constexpr std::uint64_t kDeviationBytes = 4;
// Counters of sort and scan, smaller than a word per splat or pair together.
constexpr double kCounters = 0.25;

std::uint64_t rest_floats(int sh_degree) {
    return static_cast<std::uint64_t>((sh_degree + 1) * (sh_degree + 1) - 1) * 3;
}

std::uint64_t tiles(int pixels) {
    return (static_cast<std::uint64_t>(pixels) + TILE_SIZE - 1) / TILE_SIZE;
}

}  // namespace

MemoryPlan plan_memory(const MemoryDemand& demand) {
    const std::uint64_t n = demand.splats, rest = rest_floats(demand.sh_degree);
    MemoryPlan plan;
    plan.parameters = n * kFloat * (kOtherFloats + rest);
    plan.moments = 2 * plan.parameters;
    plan.frame = n * kFrameBytes + static_cast<std::uint64_t>(kCounters * static_cast<double>(n));
    plan.pairs = demand.pairs * kPairBytes +
                 static_cast<std::uint64_t>(kCounters * static_cast<double>(demand.pairs));
    plan.photos = demand.photo_pixels * kPhotoBytes;
    plan.images = demand.image_pixels * kImageBytes;
    if (demand.exposure_photos > 0)
        plan.effects +=
            demand.image_pixels * kMappedBytes + demand.exposure_photos * kMapBytes + kMapPartials;
    if (demand.smoothing_photos > 0)
        plan.effects += n * kDeviationBytes + demand.smoothing_photos * sizeof(gpu::CameraData);
    if (demand.bucket >
        0)  // a record for each full bucket and for each tile, and its tile's number
        plan.checkpoints = (demand.pairs / demand.bucket + demand.image_tiles) *
                           (CHECKPOINT_BYTES + sizeof(std::uint32_t));
    // Attributes are replaced one at a time: the largest, the moments of one, exists twice.
    if (demand.densifies)
        plan.densify = n * (kDensifyBytes + 2 * kFloat * std::max<std::uint64_t>(rest, 4));
    return plan;
}

std::uint64_t splats_within(const MemoryDemand& demand, std::uint64_t budget_bytes) {
    MemoryDemand fixed = demand;
    fixed.splats = fixed.pairs = 0;
    const std::uint64_t fixed_bytes = plan_memory(fixed).total();
    const std::uint64_t bytes = plan_memory(demand).total() - fixed_bytes;
    if (budget_bytes <= fixed_bytes || bytes == 0) return 0;
    return static_cast<std::uint64_t>(static_cast<double>(demand.splats) *
                                      static_cast<double>(budget_bytes - fixed_bytes) /
                                      static_cast<double>(bytes));
}

void add_photos(const std::vector<View>& views, const TrainOptions& options, MemoryDemand& demand) {
    demand.sh_degree = options.sh_degree;
    std::uint64_t training = 0;
    for (const View& view : views) {
        const std::uint64_t pixels = std::uint64_t(view.camera.width) * view.camera.height;
        demand.image_pixels = std::max(demand.image_pixels, pixels);
        demand.image_tiles =
            std::max(demand.image_tiles, tiles(view.camera.width) * tiles(view.camera.height));
        if (view.is_test) continue;
        demand.photo_pixels += pixels;
        ++training;
    }
    demand.exposure_photos = options.exposure ? training : 0;
    demand.smoothing_photos = options.antialias ? training : 0;
}

}  // namespace darb
