#include "engine/stereo/depth_maps.h"

#include <algorithm>
#include <cmath>

#include "engine/gpu/commands.h"
#include "engine/primitives/groups.h"

namespace darb {

namespace {

constexpr int kStarts = 12, kSweeps = 4;
constexpr float kFirstReach = 0.04f;  // of the random changes; half of it in each further sweep
constexpr double kSteepest = 4;       // tangent of the angle between surface and picture, at most

glm::dmat3 intrinsics(const Camera& c) {
    return {c.fx, 0, 0, 0, c.fy, 0, c.cx, c.cy, 1};
}

// A word a pixel: its grey and those right of it, below it, and both, 1 to 255; 0: no photo.
void add_greys(const ImageF& grey, std::vector<std::uint32_t>& words) {
    const auto byte = [&](int x, int y) -> std::uint32_t {
        if (x >= grey.width || y >= grey.height) return 0;
        const float g = grey.at(x, y, 0);
        return g < 0 ? 0 : static_cast<std::uint32_t>(std::clamp(std::lround(255 * g), 1L, 255L));
    };
    for (int y = 0; y < grey.height; ++y)
        for (int x = 0; x < grey.width; ++x)
            words.push_back(byte(x, y) | byte(x + 1, y) << 8 | byte(x, y + 1) << 16 |
                            byte(x + 1, y + 1) << 24);
}

// Of the photo and of its sources, one after the other.
std::vector<std::uint32_t> greys_of(const std::vector<StereoPhoto>& photos, std::size_t reference) {
    std::vector<std::uint32_t> words;
    add_greys(photos[reference].grey, words);
    for (const std::uint32_t s : photos[reference].sources) add_greys(photos[s].grey, words);
    return words;
}

gpu::StereoArgs args_of(const StereoPhoto& photo, std::uint32_t seed) {
    const Camera& c = photo.camera;
    gpu::StereoArgs args{};
    args.width = static_cast<std::uint32_t>(c.width);
    args.height = static_cast<std::uint32_t>(c.height);
    args.sources = static_cast<std::uint32_t>(photo.sources.size());
    args.seed = seed;
    args.farthest = static_cast<float>(1 / photo.far);
    args.nearest = static_cast<float>(1 / photo.near);
    args.steepest = static_cast<float>(kSteepest / std::max(c.fx, c.fy));
    return args;
}

class PatchMatch {
  public:
    explicit PatchMatch(Device& device)
        : device_(&device),
          start_(device, "stereo_start", {{"THREADS", SPLAT_GROUP}, {"STARTS", kStarts}}),
          sweep_(device, "stereo_sweep", {{"THREADS", SPLAT_GROUP}}),
          commands_(device) {}

    PlaneMap run(const std::vector<StereoPhoto>& photos, std::size_t reference,
                 std::uint32_t seed) {
        const StereoPhoto& photo = photos[reference];
        PlaneMap planes(photo.grey.width, photo.grey.height, 4);
        if (photo.sources.empty()) {
            for (std::size_t i = 3; i < planes.data.size(); i += 4) planes.data[i] = STEREO_NO_COST;
            return planes;
        }
        upload(greys_, "stereo greys", greys_of(photos, reference));
        upload(sources_, "stereo sources", stereo_sources(photos, reference));
        const std::uint64_t bytes = planes.data.size() * sizeof(float);
        if (planes_.bytes() != bytes) {
            planes_ = Buffer();
            planes_ = Buffer(*device_, "stereo planes", bytes, Memory::device, "stereo");
        }
        record(args_of(photo, seed));
        commands_.submit_and_wait();
        planes.data = planes_.download<float>(planes.data.size());
        return planes;
    }

  private:
    Device* device_;
    Pipeline start_, sweep_;
    Commands commands_;
    Buffer greys_, sources_, planes_;

    template <class T>
    void upload(Buffer& buffer, const char* name, const std::vector<T>& values) {
        const std::uint64_t bytes = values.size() * sizeof(T);
        if (buffer.bytes() < bytes) {
            buffer = Buffer();
            buffer = Buffer(*device_, name, bytes, Memory::device, "stereo");
        }
        buffer.upload(values);
    }

    void record(gpu::StereoArgs args) {
        const std::uint64_t half = std::uint64_t{(args.width + 1) / 2} * args.height;
        const Groups all = groups_for(std::uint64_t{args.width} * args.height),
                     each = groups_for(half);
        commands_.begin();
        commands_.pass("stereo start");
        commands_.dispatch(start_, args, {greys_, sources_, planes_}, all.x, all.y);
        commands_.pass("stereo sweeps");
        args.reach = kFirstReach;
        for (int sweep = 0; sweep < kSweeps; ++sweep) {
            for (args.colour = 0; args.colour < 2; ++args.colour) {
                ++args.seed;
                commands_.dispatch(sweep_, args, {greys_, sources_, planes_}, each.x, each.y);
            }
            args.reach /= 2;
        }
    }
};

}  // namespace

std::vector<gpu::StereoSource> stereo_sources(const std::vector<StereoPhoto>& photos,
                                              std::size_t reference) {
    const Camera& from = photos[reference].camera;
    const glm::dmat3 ray = glm::inverse(intrinsics(from));
    std::vector<gpu::StereoSource> sources;
    std::size_t first = photos[reference].grey.data.size();
    for (const std::uint32_t s : photos[reference].sources) {
        const Camera& to = photos[s].camera;
        const glm::dmat3 turn = to.rotation * glm::transpose(from.rotation);
        gpu::StereoSource source{};
        source.toward = glm::mat3(intrinsics(to) * turn * ray);
        source.shift = glm::vec3(intrinsics(to) * (to.translation - turn * from.translation));
        source.width = static_cast<std::uint32_t>(to.width);
        source.height = static_cast<std::uint32_t>(to.height);
        source.first = static_cast<std::uint32_t>(first);
        first += photos[s].grey.data.size();
        sources.push_back(source);
    }
    return sources;
}

std::vector<PlaneMap> plane_maps(Device& device, const std::vector<StereoPhoto>& photos,
                                 std::uint64_t seed) {
    PatchMatch match(device);
    std::vector<PlaneMap> maps;
    for (std::size_t r = 0; r < photos.size(); ++r)
        maps.push_back(match.run(photos, r, static_cast<std::uint32_t>(seed * 1009 + 64 * r)));
    return maps;
}

}  // namespace darb
