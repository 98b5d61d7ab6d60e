// SPDX-License-Identifier: MIT
// HoldOut: which views of a data set are held out, as --hold-out states it.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace darb {

struct View;

struct HoldOut {
    int every = 8;  // hold out every N-th view by name, starting with the first, or the source's
                    // own test views where it names some; 0: only those
    int arc = 0;    // hold out one view in N, all from one stretch of the way round; 0: no arc
    friend bool operator==(const HoldOut&, const HoldOut&) = default;
};

/// Parses "every:8", "arc:8", or both with a comma; a missing number means 8. Throws Error naming
/// the word.
HoldOut parse_hold_out(std::string_view text);
std::string hold_out_text(const HoldOut& hold_out);

/// Sets is_test and in_arc. views: sorted by name. The source's own test views stay test views. The
/// arc is chosen among all views, from the middle of way_round(). Views that share a photo (see
/// first_of_photo) all go to one side, the test side where one of them is there, and every:N counts
/// them once. Returns a sentence about them; empty where every view has a photo of its own.
std::string mark_held_out(std::vector<View>& views, const HoldOut& hold_out);

/// For each view, the index of the first view with the same photo: the same file, or one with the
/// same bytes. Only files of equal size are read. A photo that does not exist counts as unique.
std::vector<std::size_t> first_of_photo(const std::vector<View>& views);

/// Indices of the views in the order in which their cameras stand around what they look at, seen
/// from above, beginning after the widest gap. Where the cameras stand in one place, their viewing
/// directions are ordered instead.
std::vector<std::size_t> way_round(const std::vector<View>& views);

}  // namespace darb
