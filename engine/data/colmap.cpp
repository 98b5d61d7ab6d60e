// SPDX-License-Identifier: MIT
#include "engine/data/colmap.h"

#include <fmt/format.h>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <map>
#include <tuple>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/parse_number.h"
#include "engine/data/byte_reader.h"
#include "engine/data/camera_list.h"
#include "engine/data/depths.h"
#include "engine/data/lens_model.h"
#include "engine/data/masks.h"
#include "engine/data/point_cloud_ply.h"
#include "engine/data/source.h"

namespace darb {

namespace {

// The least size of each kind of record, bytes, to check counts against.
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
    return size > 0x7fffffff ? 0 : static_cast<int>(size);  // check_lens refuses 0
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
            // The first sensor is the reference: its pose is that of the rig.
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

namespace {

constexpr std::string_view kSpace = " \t\r";

/// The lines of a text file, with their numbers, from 1.
class Lines {
  public:
    Lines(std::string_view text, const std::string& where) : text_(text), where_(where) {
        constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";  // editors on Windows add it
        if (text_.starts_with(kByteOrderMark)) text_.remove_prefix(kByteOrderMark.size());
    }

    bool next() {
        if (at_ >= text_.size()) return false;
        const std::size_t end = std::min(text_.find('\n', at_), text_.size());
        begin_ = at_;
        line_ = text_.substr(at_, end - at_);
        at_ = end + 1;
        ++number_;
        return true;
    }
    /// Goes to the next line that is neither empty nor a comment.
    bool next_record() {
        while (next()) {
            const std::size_t begin = line_.find_first_not_of(kSpace);
            if (begin != std::string_view::npos && line_[begin] != '#') return true;
        }
        return false;
    }
    /// Makes next() return the current line again.
    void back() {
        at_ = begin_;
        --number_;
    }
    std::string where() const { return fmt::format("{}, line {}", where_, number_); }

    std::string_view word(const char* what) {
        const std::size_t begin = line_.find_first_not_of(kSpace);
        if (begin == std::string_view::npos)
            throw Error(where(), fmt::format("the line ends before {}", what),
                        "The file is cut off or damaged: copy or export it again.");
        const std::size_t end = std::min(line_.find_first_of(kSpace, begin), line_.size());
        const std::string_view found = line_.substr(begin, end - begin);
        line_.remove_prefix(end);
        return found;
    }
    template <class T>
    T number(const char* what) {
        const std::string_view text = word(what);
        T value{};
        const auto [end, error] = parse_number(text.data(), text.data() + text.size(), value);
        if (error != std::errc{} || end != text.data() + text.size())
            throw Error(where(), fmt::format("'{}' is no valid {}", text, what),
                        "Export the model again.");
        return value;
    }
    /// The rest of the line, trimmed.
    std::string_view rest() const {
        const std::size_t begin = line_.find_first_not_of(kSpace);
        if (begin == std::string_view::npos) return {};
        return line_.substr(begin, line_.find_last_not_of(kSpace) + 1 - begin);
    }

  private:
    std::string_view text_, line_;
    std::size_t at_ = 0, begin_ = 0, number_ = 0;
    const std::string& where_;
};

bool is_number(std::string_view text) {
    double value = 0;
    const auto [end, error] = parse_number(text.data(), text.data() + text.size(), value);
    return error == std::errc{} && end == text.data() + text.size();
}

float number_or_nan(std::string_view text) {
    double value = 0;
    const auto [end, error] = parse_number(text.data(), text.data() + text.size(), value);
    return error == std::errc{} && end == text.data() + text.size()
               ? static_cast<float>(value)
               : std::numeric_limits<float>::quiet_NaN();
}

// Only tracks need these, so an observation whose place is not a number becomes NaN, which no track
// uses.
void add_observations(Lines& lines, ColmapImage& image) {
    while (!lines.rest().empty()) {
        for (int k = 0; k < 2; ++k)
            image.observed.push_back(number_or_nan(lines.word("the observation's place")));
        lines.word("the observation's point");
    }
}

/// Reads the line after a pose: its observations, 3 numbers each, or an empty line where it has
/// none. Some writers leave the empty line out; the line is then the next pose, which is 9 numbers
/// and a name.
void read_observations(Lines& lines, ColmapImage& image) {
    constexpr std::size_t kPoseNumbers = 9,
                          kProbed = 12;  // a name may be one number, but not three
    if (!lines.next()) return;
    if (lines.rest().starts_with('#')) return lines.back();
    std::size_t words = 0, numbers = 0;  // numbers: count of leading words that are numbers
    for (std::string_view rest = lines.rest(); !rest.empty();) {
        const std::size_t end = std::min(rest.find_first_of(kSpace), rest.size());
        if (words < kProbed && numbers == words && is_number(rest.substr(0, end))) ++numbers;
        ++words;
        rest.remove_prefix(std::min(rest.find_first_not_of(kSpace, end), rest.size()));
    }
    if (words % 3 == 0 && numbers == std::min(words, kProbed))
        return add_observations(lines, image);
    if (words > kPoseNumbers && numbers >= kPoseNumbers) return lines.back();
    throw Error(lines.where(),
                fmt::format("is neither observations, 3 numbers each, nor an image: {} words, the "
                            "first {} of them numbers",
                            words, numbers),
                "The file is cut off or damaged: copy or export it again.");
}

ColmapPose pose_of_line(Lines& lines) {
    ColmapPose pose;
    glm::dvec4 wxyz;
    for (int k = 0; k < 4; ++k) wxyz[k] = lines.number<double>("quaternion");
    for (int k = 0; k < 3; ++k) pose.translation[k] = lines.number<double>("translation");
    pose.rotation = rotation_from_quaternion(wxyz, lines.where());
    check_position(pose.translation, lines.where());
    return pose;
}

}  // namespace

ColmapRigs parse_colmap_rigs_text(std::string_view file, const std::string& where) {
    ColmapRigs rigs;
    for (Lines lines(file, where); lines.next_record();) {
        auto& rig = rigs[lines.number<std::uint32_t>("rig id")];
        const auto sensors = lines.number<std::uint32_t>("number of sensors");
        for (std::uint32_t s = 0; s < sensors; ++s) {
            const std::string_view type = lines.word("the sensor's type");
            const auto id = lines.number<std::uint32_t>("sensor id");
            // The first sensor is the reference: its pose is that of the rig.
            std::optional<ColmapPose> pose;
            if (s == 0)
                pose = ColmapPose();
            else if (lines.number<int>("whether there is a pose") != 0)
                pose = pose_of_line(lines);
            if (type == "CAMERA") rig[id] = pose;
        }
    }
    return rigs;
}

std::vector<ColmapFrame> parse_colmap_frames_text(std::string_view file, const std::string& where) {
    std::vector<ColmapFrame> frames;
    for (Lines lines(file, where); lines.next_record();) {
        ColmapFrame frame;
        frame.id = lines.number<std::uint32_t>("frame id");
        frame.rig = lines.number<std::uint32_t>("rig id");
        frame.pose = pose_of_line(lines);
        const auto data = lines.number<std::uint32_t>("number of images");
        for (std::uint32_t d = 0; d < data; ++d) {
            const std::string_view type = lines.word("the sensor's type");
            const auto camera = lines.number<std::uint32_t>("sensor id");
            const auto image = lines.number<std::uint64_t>("image id");
            if (type == "CAMERA") frame.images[image] = camera;
        }
        frames.push_back(std::move(frame));
    }
    return frames;
}

ColmapCameras parse_colmap_cameras_text(std::string_view file, const std::string& where) {
    ColmapCameras cameras;
    for (Lines lines(file, where); lines.next_record();) {
        const auto id = lines.number<std::uint32_t>("camera id");
        LensModel lens;
        lens.model = lines.word("the camera model");
        lens.width = lines.number<int>("width");
        lens.height = lines.number<int>("height");
        while (!lines.rest().empty()) lens.parameters.push_back(lines.number<double>("parameter"));
        check_lens(lens, lines.where());
        cameras[id] = std::move(lens);
    }
    return cameras;
}

std::vector<ColmapImage> parse_colmap_images_text(std::string_view file, const std::string& where) {
    std::vector<ColmapImage> images;
    for (Lines lines(file, where); lines.next_record();) {
        ColmapImage image;
        image.id = lines.number<std::uint32_t>("image id");
        glm::dvec4 wxyz;
        for (int k = 0; k < 4; ++k) wxyz[k] = lines.number<double>("quaternion");
        for (int k = 0; k < 3; ++k) image.translation[k] = lines.number<double>("translation");
        image.camera_id = lines.number<std::uint32_t>("camera id");
        image.name = lines.rest();
        if (image.name.empty())
            throw Error(lines.where(), "the image has no name", "Export the model again.");
        image.rotation = rotation_from_quaternion(wxyz, lines.where());
        check_position(image.translation, lines.where());
        read_observations(lines, image);
        images.push_back(std::move(image));
    }
    return images;
}

PointCloud parse_colmap_points_text(std::string_view file, const std::string& where,
                                    std::size_t& dropped,
                                    std::vector<std::uint32_t>* observations) {
    PointCloud points;
    points.seen_begin.push_back(0);
    dropped = 0;
    for (Lines lines(file, where); lines.next_record();) {
        lines.number<std::uint64_t>("point id");
        double position[3];
        for (double& value : position) value = lines.number<double>("coordinate");
        std::uint8_t colour[3];
        for (std::uint8_t& value : colour) value = lines.number<std::uint8_t>("colour");
        if (!std::isfinite(position[0] + position[1] + position[2])) {
            ++dropped;
            continue;
        }
        if (!lines.rest().empty()) lines.word("the error");
        while (!lines.rest().empty()) {
            points.seen_by.push_back(lines.number<std::uint32_t>("image id of the track"));
            const std::string_view word = lines.word("the point's index in the track");
            std::uint32_t observation = 0xFFFFFFFFu;  // matches no observation where the word is
                                                      // not a number
            parse_number(word.data(), word.data() + word.size(), observation);
            if (observations) observations->push_back(observation);
        }
        points.seen_begin.push_back(points.seen_by.size());
        points.position.insert(points.position.end(), position, position + 3);
        points.colour.insert(points.colour.end(), colour, colour + 3);
    }
    return points;
}

// A COLMAP model folder: picks binary or text, reads all three files, and checks that they belong
// together.

namespace {

bool has_pair(const std::filesystem::path& folder, const char* extension) {
    return std::filesystem::is_regular_file(folder / (std::string("cameras") + extension)) &&
           std::filesystem::is_regular_file(folder / (std::string("images") + extension));
}

// Fills seen_at: where each image saw the points of its tracks, as shares of its sides.
void locate_tracks(const std::vector<std::uint32_t>& observations, ColmapModel& model) {
    std::map<std::uint32_t, const ColmapImage*> images;
    for (const ColmapImage& image : model.images) images[image.id] = &image;
    PointCloud& points = model.points;
    std::size_t located = 0;
    std::vector<float> at(2 * points.seen_by.size(), std::numeric_limits<float>::quiet_NaN());
    for (std::size_t k = 0; k < points.seen_by.size(); ++k) {
        const auto image = images.find(points.seen_by[k]);
        const std::size_t number = observations[k];
        if (image == images.end() || number >= image->second->observed.size() / 2) continue;
        const auto camera = model.cameras.find(image->second->camera_id);
        if (camera == model.cameras.end()) continue;
        const LensModel& lens = camera->second;
        at[2 * k] = image->second->observed[2 * number] / static_cast<float>(lens.width);
        at[2 * k + 1] = image->second->observed[2 * number + 1] / static_cast<float>(lens.height);
        ++located;
    }
    if (located > 0) points.seen_at = std::move(at);
}

void read_points(const std::filesystem::path& folder, ColmapModel& model) {
    const auto binary = folder / "points3D.bin", text = folder / "points3D.txt",
               ply = folder / "points3D.ply";
    const bool has_binary = model.binary && std::filesystem::is_regular_file(binary);
    const bool has_own = has_binary || std::filesystem::is_regular_file(text);
    std::vector<std::uint32_t> observations;
    if (has_binary)
        model.points = parse_colmap_points(read_file(binary), binary.string(), model.dropped_points,
                                           &observations);
    else if (has_own)
        model.points = parse_colmap_points_text(read_text_file(text), text.string(),
                                                model.dropped_points, &observations);
    if (has_own) locate_tracks(observations, model);
    if (!std::filesystem::is_regular_file(ply)) return;
    std::size_t dropped = 0;
    std::vector<std::string> notes;
    PointCloud points = read_point_cloud_ply(ply, dropped, &notes);
    const std::size_t own = model.points.size() + model.dropped_points;
    if (points.size() + dropped == own) return;
    if (has_own)
        notes.push_back(fmt::format("{} was read, {} points, in place of the {} of {}.",
                                    ply.string(), points.size() + dropped, own,
                                    (has_binary ? binary : text).filename().string()));
    model.notes.insert(model.notes.end(), notes.begin(), notes.end());
    model.points = std::move(points);
    model.dropped_points = dropped;
}

}  // namespace

namespace {

/// Whether two poses are equal up to the rounding of a text file.
bool same_pose(const ColmapPose& a, const ColmapPose& b) {
    constexpr double kRounding = 1e-5;
    double apart = 0;
    for (int c = 0; c < 3; ++c)
        apart = std::max(apart, glm::distance(a.rotation[c], b.rotation[c]));
    return apart < kRounding && glm::distance(a.translation, b.translation) <
                                    kRounding * (1 + glm::length(a.translation));
}

std::string centre_of(const ColmapPose& pose) {
    const glm::dvec3 c = -(glm::transpose(pose.rotation) * pose.translation);
    return fmt::format("{:.4g}, {:.4g}, {:.4g}", c.x + 0.0, c.y + 0.0,
                       c.z + 0.0);  // + 0.0 avoids -0
}

/// Gives images the poses that follow from their frames and rigs, which COLMAP treats as the truth
/// as well.
void pose_by_rigs(const ColmapRigs& rigs, const std::vector<ColmapFrame>& frames,
                  const std::filesystem::path& listing, ColmapModel& model) {
    std::map<std::uint64_t, const ColmapFrame*> frame_of;
    for (const ColmapFrame& frame : frames)
        for (const auto& [image, camera] : frame.images) frame_of[image] = &frame;
    std::size_t changed = 0, unknown = 0;
    std::string example, first_unknown;
    for (ColmapImage& image : model.images) {
        const std::string where =
            fmt::format("{}, image {} ({})", listing.string(), image.id, image.name);
        const auto at = frame_of.find(image.id);
        if (at == frame_of.end()) {
            if (unknown++ == 0) first_unknown = image.name;
            continue;
        }
        const ColmapFrame& frame = *at->second;
        const std::uint32_t camera = frame.images.at(image.id);
        if (camera != image.camera_id)
            throw Error(where,
                        fmt::format("has camera {}, but camera {} in frame {}", image.camera_id,
                                    camera, frame.id),
                        "The files belong to different models: copy all of one model.");
        const auto rig = rigs.find(frame.rig);
        if (rig == rigs.end() || !rig->second.contains(camera))
            throw Error(where,
                        fmt::format("its frame {} belongs to rig {}, which has no camera {}",
                                    frame.id, frame.rig, camera),
                        "The files belong to different models: copy all of one model.");
        const std::optional<ColmapPose>& sensor = rig->second.at(camera);
        if (!sensor) continue;  // not calibrated: only the image's own pose is known
        const ColmapPose own{image.rotation, image.translation},
            composed{sensor->rotation * frame.pose.rotation,
                     sensor->rotation * frame.pose.translation + sensor->translation};
        if (same_pose(own, composed)) continue;
        if (changed++ == 0)
            example =
                fmt::format("{} at {}, not at {}", image.name, centre_of(composed), centre_of(own));
        image.rotation = composed.rotation;
        image.translation = composed.translation;
    }
    if (changed > 0)
        model.notes.push_back(
            fmt::format("Warning: {} of {} poses in {} are not those of its frames and rigs, which "
                        "were used, as "
                        "COLMAP does: {}. If the images are right, remove rigs and frames.",
                        changed, model.images.size(), listing.string(), example));
    if (unknown > 0)
        model.notes.push_back(fmt::format(
            "Warning: {} of {} images of {} are in no frame, the first being {}: their own poses "
            "were used.",
            unknown, model.images.size(), listing.string(), first_unknown));
}

void read_rigs(const std::filesystem::path& folder, ColmapModel& model) {
    const char* extension = model.binary ? ".bin" : ".txt";
    const auto rigs = folder / (std::string("rigs") + extension),
               frames = folder / (std::string("frames") + extension),
               images = folder / (std::string("images") + extension);
    if (!std::filesystem::is_regular_file(rigs) || !std::filesystem::is_regular_file(frames))
        return;
    const auto poses = model.binary
                           ? parse_colmap_frames(read_file(frames), frames.string())
                           : parse_colmap_frames_text(read_text_file(frames), frames.string());
    pose_by_rigs(model.binary ? parse_colmap_rigs(read_file(rigs), rigs.string())
                              : parse_colmap_rigs_text(read_text_file(rigs), rigs.string()),
                 poses, images, model);
}

}  // namespace

bool is_colmap_model(const std::filesystem::path& folder) {
    return has_pair(folder, ".bin") || has_pair(folder, ".txt");
}

std::size_t count_colmap_images(const std::filesystem::path& folder) {
    try {
        if (has_pair(folder, ".bin")) {
            std::uint64_t count = 0;  // the head of the file
            const std::vector<std::byte> head = read_file_head(folder / "images.bin", sizeof count);
            if (head.size() == sizeof count) std::memcpy(&count, head.data(), sizeof count);
            return count;
        }
        const auto images = folder / "images.txt";
        return parse_colmap_images_text(read_text_file(images), images.string()).size();
    } catch (const Error&) {
        return 0;
    }
}

ColmapModel read_colmap(const std::filesystem::path& folder) {
    ColmapModel model;
    model.binary = has_pair(folder, ".bin");
    const auto cameras = folder / (model.binary ? "cameras.bin" : "cameras.txt");
    const auto images = folder / (model.binary ? "images.bin" : "images.txt");
    if (model.binary) {
        model.cameras = parse_colmap_cameras(read_file(cameras), cameras.string());
        model.images = parse_colmap_images(read_file(images), images.string());
    } else {
        model.cameras = parse_colmap_cameras_text(read_text_file(cameras), cameras.string());
        model.images = parse_colmap_images_text(read_text_file(images), images.string());
    }
    if (model.images.empty())
        throw Error(
            images.string(), "the model holds no images",
            "The reconstruction failed: run colmap again, with more overlap or other matching.");
    for (const ColmapImage& image : model.images)
        if (!model.cameras.contains(image.camera_id))
            throw Error(fmt::format("{}, image {} ({})", images.string(), image.id, image.name),
                        fmt::format("its camera id {} is not in {}", image.camera_id,
                                    cameras.filename().string()),
                        "The files belong to different models: copy all of one model.");
    read_rigs(folder, model);
    read_points(folder, model);
    return model;
}

// A COLMAP project as a data set: model, photos and masks.

namespace fs = std::filesystem;

namespace {

/// A hint that names the folder of the project where the photo is, when it is not in the expected
/// one; else empty.
std::string folder_that_has(const fs::path& root, const std::string& name) {
    for (const fs::path& folder : folders_of(root))
        if (!find_photo(folder, name).empty() || !find_by_end(folder, name).empty())
            return folder.filename().string();
    return {};
}

/// Looks beside the model and above it, within root; for a model folder given directly (or the
/// folder of models that it is in), up to two folders above that as well. Where none of them has a
/// folder named images, takes the one that itself holds the photo `name`.
fs::path find_images_folder(const fs::path& root, const fs::path& model_folder,
                            const std::string& name, const DatasetOptions& options) {
    const fs::path base = tidy_path(fs::absolute(root)),
                   model = tidy_path(fs::absolute(model_folder));
    std::vector<fs::path> parents{base};
    if (model == base || model == base / "0")
        parents.insert(parents.end(), {base.parent_path(), base.parent_path().parent_path()});
    for (fs::path folder = model; folder != base; folder = folder.parent_path())
        parents.push_back(folder);
    for (const fs::path& parent : parents)
        if (fs::is_directory(parent / options.images_folder)) return parent / options.images_folder;
    if (options.images_folder == "images")  // the photos lie beside the model, or above it
        for (const fs::path& parent : parents)
            if (!find_photo(parent, name).empty() || !find_by_end(parent, name).empty())
                return parent;
    if (!options.require_photos) return root / options.images_folder;
    const std::string scaled = scaled_images(base), other = folder_that_has(base, name);
    throw Error((root / options.images_folder).string(), "the folder of the photos is missing",
                options.images_folder != "images" && fs::is_directory(base / "images")
                    ? "Use --images images with -r 2, 4 or 8 to scale at load."
                : scaled.empty() && !other.empty()
                    ? fmt::format("Put the photos there, or name their folder: --images {}.", other)
                : scaled.empty() ? "Put the photos there, or name their folder with --images."
                                 : fmt::format("Put the photos there, or take those of another "
                                               "size with --images {}.",
                                               scaled));
}

/// Notes other models that the mapper made beside model 0: groups of photos that it could not
/// connect to it.
void note_siblings(const fs::path& model_folder, std::size_t photos, Dataset& dataset) {
    if (model_folder.filename() != "0") return;
    std::map<fs::path, std::size_t> others;
    for (const fs::directory_entry& entry : fs::directory_iterator(model_folder.parent_path()))
        if (entry.path() != model_folder && is_colmap_model(entry.path()))
            others[entry.path()] = count_colmap_images(entry.path());
    if (others.empty()) return;
    std::string list;
    for (const auto& [path, count] : others)
        list += fmt::format("{}{} of {}", list.empty() ? "" : ", ", path.filename().string(),
                            counted(count, "photo"));
    dataset.notes.push_back(
        fmt::format("{}, of {}, was read; other pieces of the reconstruction lie beside it: {}. To "
                    "use one, name its folder.",
                    model_folder.string(), counted(photos, "photo"), list));
}

/// Finds photos that do not exist under their full names by the ends of these.
void find_photos_by_end(const fs::path& images, const std::string& listing, Dataset& dataset) {
    std::map<fs::path, std::string> used;
    for (const View& view : dataset.views)
        if (!view.photo.empty()) used.emplace(view.photo, view.name);
    std::size_t found = 0;
    std::string example;
    for (View& view : dataset.views) {
        if (!view.photo.empty()) continue;
        const fs::path photo = find_by_end(images, view.name);
        if (photo.empty()) continue;
        const auto [at, is_new] = used.emplace(photo, view.name);
        if (!is_new)
            throw Error(fmt::format("{}, {}", listing, view.name),
                        fmt::format("is not there, and by the end of its name it is {}, the photo "
                                    "of {} as well",
                                    photo.string(), at->second),
                        "Put the photos into the folders that the names have, or name the folder "
                        "that has these with --images.");
        if (found++ == 0)
            example = fmt::format("{} is {}", view.name, photo.lexically_relative(images).string());
        view.photo = photo;
        view.name = photo.lexically_relative(images).generic_string();
    }
    if (found > 0)
        dataset.notes.push_back(fmt::format("Found in {} by the end of their names: {}, as {}.",
                                            images.string(), counted(found, "photo"), example));
}

void check_photos(const std::vector<View>& views, const fs::path& root,
                  const fs::path& model_folder) {
    std::size_t missing = 0;
    const View* first = nullptr;
    for (const View& view : views) {
        check_is_file(view.photo);  // throws where something else than a file is there
        if (!fs::is_regular_file(view.photo) && missing++ == 0) first = &view;
    }
    const std::string other = first ? folder_that_has(root, first->name) : "";
    if (first)
        throw Error(first->photo.string(),
                    fmt::format("the photo is missing, and with it {} of the {} that {} lists",
                                missing, views.size(), model_folder.string()),
                    fmt::format("Put the photos back, name their folder with --images{}, or take "
                                "them out of the model with colmap image_deleter.",
                                other.empty() ? "" : " " + other));
}

}  // namespace

Dataset load_colmap(const fs::path& root, const fs::path& model_folder,
                    const DatasetOptions& options) {
    ColmapModel model = read_colmap(model_folder);
    Dataset dataset;
    dataset.root = root;
    dataset.source = model.binary ? "COLMAP binary" : "COLMAP text";
    const fs::path images =
        find_images_folder(root, model_folder, model.images.front().name, options);
    for (const ColmapImage& image : model.images) {
        View view;
        view.name = image.name;
        view.source_id = image.id;
        view.photo = find_photo(images, image.name);
        view.lens = model.cameras.at(image.camera_id);
        view.camera.rotation = image.rotation;
        view.camera.translation = image.translation;
        dataset.views.push_back(std::move(view));
    }
    find_photos_by_end(images, model_folder.string(), dataset);
    for (View& view : dataset.views)
        if (view.photo.empty()) view.photo = images / view.name;
    if (options.require_photos) check_photos(dataset.views, root, model_folder);
    // Masks and depths lie beside the folder of the photos, or in it where photos lie with the
    // model.
    const bool with_model = images.filename() != fs::path(options.images_folder).filename();
    const fs::path around = with_model ? images : images.parent_path();
    add_masks(around, options, dataset);
    add_depths(around, images, options, dataset);
    dataset.points = std::move(model.points);
    dataset.notes.insert(dataset.notes.end(), model.notes.begin(), model.notes.end());
    if (model.dropped_points > 0)
        dataset.notes.push_back(fmt::format("{} with NaN or infinity were dropped.",
                                            counted(model.dropped_points, "point")));
    note_siblings(model_folder, dataset.views.size(), dataset);
    return dataset;
}

namespace {

constexpr std::int32_t kPinholeId = 1;

class Writer {
  public:
    template <class T>
    void put(T value) {
        const auto* bytes = reinterpret_cast<const std::byte*>(&value);
        bytes_.insert(bytes_.end(), bytes, bytes + sizeof(T));
    }
    void put_string(const std::string& text) {
        for (const char c : text) put(c);
        put('\0');
    }
    std::span<const std::byte> bytes() const { return bytes_; }

  private:
    std::vector<std::byte> bytes_;
};

using Intrinsics = std::tuple<int, int, double, double, double, double>;

Intrinsics intrinsics(const Camera& camera) {
    return {camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy};
}

}  // namespace

void write_colmap_binary(const std::filesystem::path& folder, const std::vector<View>& views,
                         const PointCloud& points) {
    std::map<Intrinsics, std::uint32_t> camera_ids;
    for (const View& view : views)
        camera_ids.try_emplace(intrinsics(view.camera),
                               static_cast<std::uint32_t>(camera_ids.size() + 1));
    Writer cameras;
    cameras.put<std::uint64_t>(camera_ids.size());
    for (const auto& [camera, id] : camera_ids) {
        const auto& [width, height, fx, fy, cx, cy] = camera;
        cameras.put<std::uint32_t>(id);
        cameras.put<std::int32_t>(kPinholeId);
        cameras.put<std::uint64_t>(static_cast<std::uint64_t>(width));
        cameras.put<std::uint64_t>(static_cast<std::uint64_t>(height));
        for (const double value : {fx, fy, cx, cy}) cameras.put(value);
    }

    Writer images;
    images.put<std::uint64_t>(views.size());
    for (std::size_t i = 0; i < views.size(); ++i) {
        const Camera& camera = views[i].camera;
        const glm::dvec4 wxyz = quaternion_from_rotation(camera.rotation);
        images.put(static_cast<std::uint32_t>(i + 1));
        for (int k = 0; k < 4; ++k) images.put(wxyz[k]);
        for (int k = 0; k < 3; ++k) images.put(camera.translation[k]);
        images.put(camera_ids.at(intrinsics(camera)));
        images.put_string(views[i].name);
        images.put<std::uint64_t>(0);  // observations
    }

    Writer cloud;
    cloud.put<std::uint64_t>(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
        cloud.put<std::uint64_t>(i + 1);
        for (std::size_t k = 0; k < 3; ++k) cloud.put(points.position[i * 3 + k]);
        for (std::size_t k = 0; k < 3; ++k) cloud.put(points.colour[i * 3 + k]);
        cloud.put(0.0);               // reprojection error
        cloud.put<std::uint64_t>(0);  // track
    }
    write_file_atomic(folder / "cameras.bin", cameras.bytes());
    write_file_atomic(folder / "images.bin", images.bytes());
    write_file_atomic(folder / "points3D.bin", cloud.bytes());
}

}  // namespace darb
