// SPDX-License-Identifier: MIT
// EffectPlan: which effects of shaders/shared/effect_list.h a scene or a data set calls for, each
// with the number that was measured on it. What is off is not compiled, not stored, not computed.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/core/image.h"
#include "engine/data/dataset.h"
#include "engine/raster/forward_options.h"
#include "engine/scene/splat_model.h"
#include "shaders/shared/effect_list.h"
#include "shaders/shared/limits.h"

namespace darb {

/// The name of an effect on the command line and in files.
std::string_view effect_name(int effect);
std::optional<int> effect_from_name(std::string_view name);

/// What a plan is made for.
enum class EffectUse { pictures, measuring, training };
/// Effects that this use can do nothing with: those of photos alone in pictures, depths in
/// training.
std::vector<int> impossible_effects(EffectUse use);

struct EffectRow {
    bool on = false;
    bool overridden = false;  // the command line said so
    int degree = 0;           // degree of EFFECT_VIEW_COLOUR
    double measured = 0;      // what the rule looked at; its unit stands in the reason
    std::string reason;       // a clause
    bool tried = false;       // EFFECT_SHUTTER: off at first, a probe in training decides
};

struct EffectPlan {
    std::array<EffectRow, EFFECT_COUNT> rows;

    bool on(int effect) const { return rows[static_cast<std::size_t>(effect)].on; }
    EffectRow& row(int effect) { return rows[static_cast<std::size_t>(effect)]; }
    const EffectRow& row(int effect) const { return rows[static_cast<std::size_t>(effect)]; }
    /// For a rendering: without the 3D filter, which only training has.
    ProjectionEffects projection() const;
    /// Counters decide, frame by frame, where the command line does not.
    HugeSplatPath huge_splat_path() const {
        if (!row(EFFECT_HUGE).overridden) return HugeSplatPath::by_counters;
        return on(EFFECT_HUGE) ? HugeSplatPath::always : HugeSplatPath::never;
    }
    /// EFFECT_HUGE as the counters of a frame say; the most of several frames counts.
    void note_frame(std::uint32_t huge_splats, std::uint32_t longest_list);

  private:
    std::uint32_t most_huge_ = 0, longest_list_ = 0;  // maxima over the frames that were noted
};

/// "auto", "all", "none", or changes to one of them, auto where none is named: "+exposure,-sh",
/// "all,-lens".
struct EffectChoice {
    enum class Base { automatic, all, none } base = Base::automatic;
    std::array<std::optional<bool>, EFFECT_COUNT> changed{};
};
/// Throws Error naming the word that is no effect.
EffectChoice parse_effects(std::string_view text);
/// The words of --effects; without lenses the photos of data are straightened at load. Throws Error
/// where they cannot be read, ask for an effect that the use cannot have, or contradict --lens.
EffectChoice choose_effects(const std::string& text, EffectUse use, DatasetOptions& data);
/// What the words say of this effect by its name: + is true, - is false; nothing where they do not
/// name it.
std::optional<bool> effect_in_words(std::string_view text, std::string_view effect);
/// Whether the words leave this effect out, by its name or by `none`.
bool words_refuse_effect(std::string_view text, std::string_view effect);

/// What a rendering asks for beside the pictures themselves.
struct RenderOutputs {
    bool depth = false;
    float near_plane = static_cast<float>(NEAR_DEFAULT);
    /// A viewer's, beside the views: near-plane care is called for, and its principal point is in
    /// the middle of the area beside the panel.
    bool free_camera = false;
};

/// For pictures of a scene through these cameras (none: only what the file decides, and care for
/// the near plane). An effect that is an identity where the rule says off may be forced on;
/// anti-aliasing is as the file says, as another choice would show another scene: `all` leaves it
/// alone, `none` and -antialias drop it.
EffectPlan plan_rendering(const SplatModel& model, const std::vector<View>& views,
                          const RenderOutputs& outputs, const EffectChoice& choice = {});

/// For training. photos: as load_photos gives them, for the exposure's rule; empty: that effect is
/// off. The degree of view-dependent colour is found while training: see TrainOptions::probe_sh.
EffectPlan plan_training(const Dataset& dataset, const std::vector<ImageU8>& photos, int sh_degree,
                         const EffectChoice& choice = {});

/// The model as the plan wants it: higher bands dropped, the render mode as planned.
void apply_plan(const EffectPlan& plan, SplatModel& model);
/// The cameras as the plan wants them: pinholes where lenses are off, and without shutters that
/// roll where that effect is.
void apply_plan(const EffectPlan& plan, std::vector<View>& views);

/// One line: the effects that are on, with their reasons.
std::string plan_line(const EffectPlan& plan);

// AntialiasProbe: what anti-aliasing gained in a trial, at the size that was trained on and at
// others, and what a plan makes of it.

struct ProbedSize {
    double scale = 1;                    // relative to the sides of the training photos
    int width = 0, height = 0;           // size of the first view, px
    double without_db = 0, with_db = 0;  // mean PSNR of the held-out photos
};

struct ProbedRun {
    double seconds = 0;
    std::size_t splats = 0;
};

struct AntialiasProbe {
    int iterations = 0;
    ProbedRun without, with;
    std::vector<ProbedSize> sizes;  // by scale, ascending; not empty
    double gain_db() const;         // mean over the sizes
    /// Whether it gains in that mean and loses no more than 1 dB at the trained size.
    bool pays() const;
};

/// Sets the row of anti-aliasing as the probe decides; where the command line has decided, only its
/// reason.
void take_probe(const AntialiasProbe& probe, EffectPlan& plan);

// Trial: what one way of training gained over another in two short runs, on photos that neither
// saw.

struct Trial {
    std::string tried, usual;  // what is given for each: "--kernel beta"
    int iterations = 0;
    ProbedRun usual_run{}, tried_run{};
    double usual_db = 0, tried_db = 0;  // mean PSNR of the held-out photos
    double price = 0;                   // extra time, as a share: 0.1 is 10 %
    double gain_db() const { return tried_db - usual_db; }
    /// Whether it gains more than two runs of one way differ by chance.
    bool pays() const { return gain_db() > kLeastGain_db; }
    /// The advice in words.
    std::string advice() const;

    static constexpr double kLeastGain_db = 0.2;  // docs/experiments/README.md
};

}  // namespace darb
