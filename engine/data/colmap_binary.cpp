#include <fmt/format.h>

#include <cmath>

#include "engine/data/byte_reader.h"
#include "engine/data/colmap.h"
#include "engine/data/lens_model.h"
#include "engine/data/pose.h"

namespace darb {

namespace {

// Least bytes of a record, for counts.
constexpr std::size_t kCameraBytes = 4 + 4 + 8 + 8 + 3 * 8;
constexpr std::size_t kImageBytes = 4 + 7 * 8 + 4 + 1 + 8;
constexpr std::size_t kObservationBytes = 8 + 8 + 8;
constexpr std::size_t kPointBytes = 8 + 3 * 8 + 3 + 8 + 8;
constexpr std::size_t kTrackBytes = 4 + 4;

constexpr std::size_t kRigBytes = 4 + 4, kFrameBytes = 4 + 4 + 7 * 8 + 4;
constexpr std::int32_t kCameraSensor = 0;

ColmapPose read_colmap_pose(ByteReader& reader) {
    ColmapPose pose;
    glm::dvec4 wxyz;
    for (int k = 0; k < 4; ++k) wxyz[k] = reader.read<double>();
    for (int k = 0; k < 3; ++k) pose.translation[k] = reader.read<double>();
    pose.rotation = rotation_from_quaternion(wxyz, reader.where());
    check_position(pose.translation, reader.where());
    return pose;
}

int read_size(ByteReader& reader) {
    const auto size = reader.read<std::uint64_t>();
    return size > 0x7fffffff ? 0 : static_cast<int>(size);  // 0 is refused by check_lens
}

}  // namespace

ColmapCameras parse_colmap_cameras(std::span<const std::byte> file, const std::string& where) {
    ByteReader reader(file, where);
    const std::size_t count = reader.read_count(kCameraBytes, "cameras");
    ColmapCameras cameras;
    for (std::size_t i = 0; i < count; ++i) {
        reader.set_record(fmt::format("camera {} of {}", i + 1, count));
        const auto id = reader.read<std::uint32_t>();
        const auto model = reader.read<std::int32_t>();
        LensModel lens;
        lens.model = lens_model_name(model);
        if (lens.model.empty())
            throw Error(reader.where(), fmt::format("the camera model id {} is unknown", model),
                        "Undistort with `colmap image_undistorter`, which writes PINHOLE.");
        lens.width = read_size(reader);
        lens.height = read_size(reader);
        for (int p = 0; p < lens_parameter_count(lens.model); ++p)
            lens.parameters.push_back(reader.read<double>());
        check_lens(lens, reader.where());
        cameras[id] = std::move(lens);
    }
    return cameras;
}

std::vector<ColmapImage> parse_colmap_images(std::span<const std::byte> file,
                                             const std::string& where) {
    ByteReader reader(file, where);
    const std::size_t count = reader.read_count(kImageBytes, "images");
    std::vector<ColmapImage> images;
    for (std::size_t i = 0; i < count; ++i) {
        reader.set_record(fmt::format("image {} of {}", i + 1, count));
        ColmapImage image;
        image.id = reader.read<std::uint32_t>();
        glm::dvec4 wxyz;
        for (int k = 0; k < 4; ++k) wxyz[k] = reader.read<double>();
        for (int k = 0; k < 3; ++k) image.translation[k] = reader.read<double>();
        image.camera_id = reader.read<std::uint32_t>();
        image.name = reader.read_string();
        reader.set_record(fmt::format("image {} of {} ({})", i + 1, count, image.name));
        image.rotation = rotation_from_quaternion(wxyz, reader.where());
        check_position(image.translation, reader.where());
        const std::size_t observations = reader.read_count(kObservationBytes, "observations");
        image.observed.reserve(2 * observations);
        for (std::size_t k = 0; k < observations; ++k) {
            image.observed.push_back(static_cast<float>(reader.read<double>()));
            image.observed.push_back(static_cast<float>(reader.read<double>()));
            reader.skip(8);  // the point
        }
        images.push_back(std::move(image));
    }
    return images;
}

PointCloud parse_colmap_points(std::span<const std::byte> file, const std::string& where,
                               std::size_t& dropped, std::vector<std::uint32_t>* observations) {
    ByteReader reader(file, where);
    const std::size_t count = reader.read_count(kPointBytes, "points");
    PointCloud points;
    points.seen_begin.push_back(0);
    points.position.reserve(count * 3);
    points.colour.reserve(count * 3);
    dropped = 0;
    for (std::size_t i = 0; i < count; ++i) {
        reader.set_record(fmt::format("point {} of {}", i + 1, count));
        reader.skip(8);  // id
        double position[3];
        for (double& value : position) value = reader.read<double>();
        std::uint8_t colour[3];
        for (std::uint8_t& value : colour) value = reader.read<std::uint8_t>();
        reader.skip(8);  // error
        const std::size_t track = reader.read_count(kTrackBytes, "track elements");
        const bool finite = std::isfinite(position[0] + position[1] + position[2]);
        for (std::size_t t = 0; t < track; ++t) {
            const auto image = reader.read<std::uint32_t>();
            const auto observation = reader.read<std::uint32_t>();
            if (!finite) continue;
            points.seen_by.push_back(image);
            if (observations) observations->push_back(observation);
        }
        if (!finite) {
            ++dropped;
            continue;
        }
        points.seen_begin.push_back(points.seen_by.size());
        points.position.insert(points.position.end(), position, position + 3);
        points.colour.insert(points.colour.end(), colour, colour + 3);
    }
    return points;
}

ColmapRigs parse_colmap_rigs(std::span<const std::byte> file, const std::string& where) {
    ByteReader reader(file, where);
    const std::size_t count = reader.read_count(kRigBytes, "rigs");
    ColmapRigs rigs;
    for (std::size_t i = 0; i < count; ++i) {
        reader.set_record(fmt::format("rig {} of {}", i + 1, count));
        auto& rig = rigs[reader.read<std::uint32_t>()];
        const auto sensors = reader.read<std::uint32_t>();
        for (std::uint32_t s = 0; s < sensors; ++s) {
            const auto type = reader.read<std::int32_t>();
            const auto id = reader.read<std::uint32_t>();
            // The first is the reference: the rig's own frame.
            std::optional<ColmapPose> pose;
            if (s == 0)
                pose = ColmapPose();
            else if (reader.read<std::uint8_t>() != 0)
                pose = read_colmap_pose(reader);
            if (type == kCameraSensor) rig[id] = pose;
        }
    }
    return rigs;
}

std::vector<ColmapFrame> parse_colmap_frames(std::span<const std::byte> file,
                                             const std::string& where) {
    ByteReader reader(file, where);
    const std::size_t count = reader.read_count(kFrameBytes, "frames");
    std::vector<ColmapFrame> frames;
    for (std::size_t i = 0; i < count; ++i) {
        reader.set_record(fmt::format("frame {} of {}", i + 1, count));
        ColmapFrame frame;
        frame.id = reader.read<std::uint32_t>();
        frame.rig = reader.read<std::uint32_t>();
        frame.pose = read_colmap_pose(reader);
        const auto data = reader.read<std::uint32_t>();
        for (std::uint32_t d = 0; d < data; ++d) {
            const auto type = reader.read<std::int32_t>();
            const auto camera = reader.read<std::uint32_t>();
            const auto image = reader.read<std::uint64_t>();
            if (type == kCameraSensor) frame.images[image] = camera;
        }
        frames.push_back(std::move(frame));
    }
    return frames;
}

}  // namespace darb
