#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <limits>

#include "engine/core/error.h"
#include "engine/data/colmap.h"
#include "engine/data/lens_model.h"
#include "engine/data/pose.h"

namespace darb {

namespace {

constexpr std::string_view kSpace = " \t\r";

/// The lines of a text file, by number from 1.
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
    /// The next line that is neither empty nor a comment.
    bool next_record() {
        while (next()) {
            const std::size_t begin = line_.find_first_not_of(kSpace);
            if (begin != std::string_view::npos && line_[begin] != '#') return true;
        }
        return false;
    }
    /// The next line is read again by next.
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
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
        if (error != std::errc{} || end != text.data() + text.size())
            throw Error(where(), fmt::format("'{}' is no valid {}", text, what),
                        "Export the model again.");
        return value;
    }
    /// What is left of the line, trimmed.
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
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    return error == std::errc{} && end == text.data() + text.size();
}

float number_or_nan(std::string_view text) {
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    return error == std::errc{} && end == text.data() + text.size()
               ? static_cast<float>(value)
               : std::numeric_limits<float>::quiet_NaN();
}

// Only tracks need them: a place that is no number is one that no track has.
void add_observations(Lines& lines, ColmapImage& image) {
    while (!lines.rest().empty()) {
        for (int k = 0; k < 2; ++k)
            image.observed.push_back(number_or_nan(lines.word("the observation's place")));
        lines.word("the observation's point");
    }
}

/// After a pose: its observations, 3 numbers each, or an empty line where it has none. Some writers
/// leave empty lines out; the line is then the next pose, of 9 numbers and a name.
void read_observations(Lines& lines, ColmapImage& image) {
    constexpr std::size_t kPoseNumbers = 9, kProbed = 12;  // a name may be a number, not three
    if (!lines.next()) return;
    if (lines.rest().starts_with('#')) return lines.back();
    std::size_t words = 0, numbers = 0;  // numbers: of the first words, before any other word
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
            // The first is the reference: the rig's own frame.
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
            std::uint32_t observation = 0xFFFFFFFFu;  // of no image, where it is no number
            std::from_chars(word.data(), word.data() + word.size(), observation);
            if (observations) observations->push_back(observation);
        }
        points.seen_begin.push_back(points.seen_by.size());
        points.position.insert(points.position.end(), position, position + 3);
        points.colour.insert(points.colour.end(), colour, colour + 3);
    }
    return points;
}

}  // namespace darb
