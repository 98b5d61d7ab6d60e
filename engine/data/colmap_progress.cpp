#include "engine/data/colmap_progress.h"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace darb {

namespace {

// Time of the mapper over the number of photos: with this power on recorded runs.
constexpr double kMapperPower = 1.5;

bool is_digit(char c) {
    return c >= '0' && c <= '9';
}

/// The number that `text` begins with, which is taken off; false where it begins with none.
bool take_number(std::string_view& text, std::size_t& number) {
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc{}) return false;
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    return true;
}

bool take(std::string_view& text, char c) {
    while (text.starts_with(' ')) text.remove_prefix(1);
    if (!text.starts_with(c)) return false;
    text.remove_prefix(1);
    while (text.starts_with(' ')) text.remove_prefix(1);
    return true;
}

/// What stands behind the first of these words; nothing where none is there.
bool find_behind(std::string_view text, std::initializer_list<std::string_view> words,
                 std::string_view& behind) {
    for (const std::string_view word : words)
        if (const std::size_t at = text.find(word); at != std::string_view::npos) {
            behind = text.substr(at + word.size());
            return true;
        }
    return false;
}

struct Counts {
    std::size_t a = 0, of_a = 0, b = 1, of_b = 1;
};

/// "3/60]" or "1/4, 2/4]", taken off.
bool take_counts(std::string_view& text, Counts& counts) {
    if (!take_number(text, counts.a) || !take(text, '/') || !take_number(text, counts.of_a))
        return false;
    if (take(text, ',') &&
        (!take_number(text, counts.b) || !take(text, '/') || !take_number(text, counts.of_b)))
        return false;
    return take(text, ']') && counts.a >= 1 && counts.a <= counts.of_a && counts.b >= 1 &&
           counts.b <= counts.of_b && counts.of_a <= 10'000'000 && counts.of_b <= 10'000'000;
}

/// The text behind the head of glog, "I20250412 20:08:49.215745 96464 file.cc:390] ".
std::string_view without_head(std::string_view line) {
    if (line.size() > 2 && std::string_view("IWEF").find(line[0]) != std::string_view::npos &&
        is_digit(line[1]))
        if (const std::size_t at = line.find("] "); at != std::string_view::npos)
            line.remove_prefix(at + 2);
    while (line.starts_with(' ')) line.remove_prefix(1);
    return line;
}

/// " in 45.332s" or "in 7.1s": how long a part took that is done.
bool is_duration(std::string_view text) {
    while (text.starts_with(' ')) text.remove_prefix(1);
    while (text.ends_with(' ') || text.ends_with('\r')) text.remove_suffix(1);
    return text.size() > 4 && text.starts_with("in ") && is_digit(text[3]) && text.ends_with('s');
}

}  // namespace

bool ColmapOutput::set(std::size_t done, std::size_t total) {
    const bool changed = done != done_ || total != total_;
    done_ = done;
    total_ = total;
    return changed;
}

bool ColmapOutput::read_match(std::string_view text) {
    std::string_view behind;
    Counts counts;
    bool ended = false;
    if (find_behind(text,
                    {"Matching block [", "Processing block [", "Matching image [",
                     "Processing image [", "Matching batch [", "Processing batch ["},
                    behind) &&
        take_counts(behind, counts)) {
        parts_ = counts.of_a * counts.of_b;
        parts_begun_ = (counts.a - 1) * counts.of_b + counts.b;
        ended = is_duration(behind);
    } else if (parts_begun_ > 0 && is_duration(text)) {
        ended = true;
    } else {
        return false;
    }
    const std::size_t parts_done = parts_begun_ - (ended ? 0 : 1);
    if (pairs_ == 0) return set(std::max(done_, parts_done), parts_);
    // Blocks hold about as many pairs each.
    const double share = double(parts_done) / double(parts_);
    return set(std::max(done_, std::size_t(std::llround(share * double(pairs_)))), pairs_);
}

bool ColmapOutput::read_map(std::string_view text) {
    std::string_view behind;
    std::size_t number = 0;
    if (find_behind(text, {"Initializing with image pair #", "Registering initial image pair #"},
                    behind)) {
        if (done_ > 2) ++model_;  // two alone were given up
        return set(2, photos_);
    }
    if (!find_behind(text, {"Registering image #"}, behind) || !take_number(behind, number) ||
        !take(behind, '('))
        return false;
    if (behind.starts_with("num_reg_"))
        behind.remove_prefix(std::min(behind.find('='), behind.size()));
    if (behind.starts_with('=')) behind.remove_prefix(1);
    if (!take_number(behind, number) || !behind.starts_with(')')) return false;
    return set(photos_ > 0 ? std::min(number, photos_) : number, photos_);
}

bool ColmapOutput::read(std::string_view line) {
    const std::string_view text = without_head(line);
    std::string_view behind;
    Counts counts;
    switch (step_) {
        case ColmapStep::extract: {
            std::size_t number = 0;
            if (text.starts_with("Features:")) {
                behind = text.substr(9);
                while (behind.starts_with(' ')) behind.remove_prefix(1);
                if (take_number(behind, number)) features_.push_back(number);
                return false;
            }
            return text.starts_with("Processed file [") &&
                   take_counts(behind = text.substr(16), counts) && set(counts.a, counts.of_a);
        }
        case ColmapStep::match:
            return read_match(text);
        case ColmapStep::map:
            return read_map(text);
        case ColmapStep::undistort:
            return find_behind(text, {"Undistorting image ["}, behind) &&
                   take_counts(behind, counts) && set(counts.a, counts.of_a);
    }
    return false;
}

double colmap_seconds_left(ColmapStep step, double seconds, std::size_t done, std::size_t total) {
    if (done == 0 || total == 0 || seconds <= 0) return -1;
    const double ratio = double(total) / double(std::min(done, total));
    const double power = step == ColmapStep::map ? kMapperPower : 1.0;
    return seconds * (std::pow(ratio, power) - 1);
}

}  // namespace darb
