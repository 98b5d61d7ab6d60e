// How far a step of COLMAP is, read from what it prints. Versions differ: 3.7 and 3.8 print plain
// lines, of which some end only when the work that they name is done; from 3.9 on a head of glog
// (date, thread, file) stands before each; 3.12 and later count frames in place of photos.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace darb {

enum class ColmapStep { extract, match, map, undistort };
constexpr std::size_t kColmapSteps = 4;

/// What one step has printed so far.
class ColmapOutput {
  public:
    /// photos: of the folder; 0: not known. pairs: that an exhaustive matcher compares, else 0.
    ColmapOutput(ColmapStep step, std::size_t photos, std::size_t pairs)
        : step_(step), photos_(photos), pairs_(pairs) {}

    /// A line, or the beginning of one that is not ended yet. Whether done() or total() changed.
    bool read(std::string_view line);

    /// Photos, or pairs of photos where unit() says so. total() is 0 until it is known.
    std::size_t done() const { return done_; }
    std::size_t total() const { return total_; }
    const char* unit() const {
        return step_ == ColmapStep::match && pairs_ > 0 ? "pairs" : "photos";
    }
    /// Of the mapper: which of its models the photos are being added to, from 1.
    std::size_t model() const { return model_; }
    /// Of the extractor: what it said of each photo, in its order.
    const std::vector<std::size_t>& features() const { return features_; }

  private:
    bool set(std::size_t done, std::size_t total);
    bool read_match(std::string_view text);
    bool read_map(std::string_view text);

    ColmapStep step_;
    std::size_t photos_, pairs_, done_ = 0, total_ = 0, model_ = 1;
    std::size_t parts_begun_ = 0, parts_ = 0;  // of the matcher: blocks, or photos
    std::vector<std::size_t> features_;
};

/// What is left of a step that took `seconds` for `done` of `total`; below 0: not known. The mapper
/// adjusts all photos again and again, so that each takes longer than the one before.
double colmap_seconds_left(ColmapStep step, double seconds, std::size_t done, std::size_t total);

}  // namespace darb
