// HoldOut: which views of a data set are held out, as --hold-out says it.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace darb {

struct View;

struct HoldOut {
    int every = 8;  // every so many views by name from the first on, or the source's own test
                    // views where it names some; 0: none but those
    int arc = 0;    // one in so many views, all of one stretch of the way round; 0: no arc
    friend bool operator==(const HoldOut&, const HoldOut&) = default;
};

/// "every:8", "arc:8", both with a comma; without a number it is 8. Throws Error naming the word.
HoldOut parse_hold_out(std::string_view text);
std::string hold_out_text(const HoldOut& hold_out);

/// Sets is_test and in_arc; views: by name. The source's own test views stay so. The arc is taken
/// of all views, from the middle of way_round(). Views of one photo (see first_of_photo) are all on
/// one side, that of the test where one of them is there, and every:N counts them once. Returns a
/// sentence about them; empty where every view has a photo of its own.
std::string mark_held_out(std::vector<View>& views, const HoldOut& hold_out);

/// For each view the index of the first view of the same photo: the same file, or one with the same
/// bytes. Only files of equal size are read. A photo that is not there is one of its own.
std::vector<std::size_t> first_of_photo(const std::vector<View>& views);

/// Indices of the views in the order in which their cameras stand around what they look at, seen
/// from above; it begins behind the widest gap. By the direction of sight where cameras stand in
/// one place.
std::vector<std::size_t> way_round(const std::vector<View>& views);

}  // namespace darb
