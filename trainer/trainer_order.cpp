// The order of the splats in memory, see morton_order.h.
#include "trainer/trainer.h"

namespace darb {

namespace {
constexpr float kGridExtents = 4;  // of half the grid's side: a cell is 1/128 of the scene's extent
}

void Trainer::settle_order() {
    if (!morton_) return;
    MortonGrid grid;
    for (const int view : train_views_)
        grid.centre += camera_data_[view].centre / static_cast<float>(train_views_.size());
    grid.half_side = kGridExtents * static_cast<float>(extent_);
    morton_->run(splats_, density_, grid);
    note_round(splats_.count());
    smoothing_stale_ = true;
}

}  // namespace darb
