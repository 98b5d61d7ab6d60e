#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The guards of the hard cases: which line of the sources each one is, and which test watches it.

    tools/lab/guards.py check               strings and tests exist, docs/hard_cases.md says the same
    tools/lab/guards.py docs                rewrites its table, and those of docs/experiments/float32.md from
                                        assets/results/truth_lavapipe.json (tools/lab/truth_figures.py)
    tools/lab/guards.py run [NAME...]       disables each guard in turn in a copy of the sources (build-guards)
                                        and fails unless the named test turns red; minutes
"""

import filecmp
import os
import re
import shutil
import subprocess
import sys

import truth_figures

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
CASES, FIGURES = "docs/hard_cases.md", "docs/experiments/float32.md"
COPY = "build-guards"

PROJECT = "shaders/forward/project.comp"
CAMERA = "shaders/effects/camera_model.glsl"
COVARIANCE = "shaders/lib/covariance.glsl"
VALUES = "shaders/lib/splat_values.glsl"
GRADIENT = "shaders/backward/project_gradient.glsl"
BLEND = "shaders/forward/blend.comp"
BLEND_BACK = "shaders/backward/area_walk.glsl"
SPLAT_SUMS = "shaders/backward/splat_sums.glsl"
BACK = "shaders/backward/project_backward.comp"

# case, guard, file, the guarding text, its replacement without the guard, test program, test (gtest filter)
GUARDS = [
    ("splat behind or on the near plane", "near_plane", PROJECT,
     " || !(p.z > camera.near_plane)", "",
     "project_test", "Project.each_cull_reason_is_counted"),
    ("Jacobian beyond 1.3 tan(fov/2)", "jacobian_clamp", CAMERA,
     "return clamp(ratio, OFF_CENTRE == 1 ? camera.ratio_min : -camera.ratio_max, camera.ratio_max);",
     "return ratio;",
     "project_test", "Project.wide_splats_outside_the_view_match_through_the_jacobian_clamp"),
    ("Jacobian beyond 1.3 tan(fov/2)", "jacobian_clamp_gradient", CAMERA,
     "if (NEAR_CARE == 0 || (free_ratio > limits.x && free_ratio < limits.y))", "if (true)",
     "project_backward_test", "ProjectBackward.splats_beyond_the_jacobian_clamp_match_double"),
    ("needles and discs to 1e6", "determinant_as_product", COVARIANCE,
     "dot(across, across) + h * (n1 + n2) + h * h", "(n1 + h) * c - b * b",
     "hard_case_test", "every/HardCase.matches_double/needles_gaussian_psi"),
    ("needles and discs to 1e6", "whitened_gradient", GRADIENT,
     "(cross(r2, cross(r1, r2)) + h * r1) * l22 * inversesqrt(f.determinant)",
     "(f.l11 * r1 + f.l21 * r2) * inverse_of_power(f.shrink)",
     "walk_test", "WalkCases.needles_across_the_picture_match_double"),
    ("determinant tiny, huge or not positive", "determinant_limits", PROJECT,
     "f.determinant > DETERMINANT_MIN * unit_area * unit_area", "true",
     "project_test", "Project.each_cull_reason_is_counted"),
    ("quaternion zero, tiny, huge, not normalised", "quaternion_limits", COVARIANCE,
     "magnitude_below(q, 1e30) && is_finite(norm) && norm * norm > ROTATION_MIN_SQUARE", "true",
     "project_test", "Project.each_cull_reason_is_counted"),
    ("quaternion zero, tiny, huge, not normalised", "normalisation_gradient", GRADIENT,
     "(d_unit - unit * dot(unit, d_unit)) / norm", "d_unit",
     "project_backward_test", "ProjectBackward.quaternions_of_any_norm_match_double"),
    ("log-scale of 50, opacity logit of 1e4", "scale_limit", VALUES,
     "exp(clamp(stored, -LOG_SCALE_LIMIT, LOG_SCALE_LIMIT))", "exp(stored)",
     "hard_case_test", "every/HardCase.matches_double/longest_needle_gaussian_psi"),
    ("log-scale of 50, opacity logit of 1e4", "scale_limit_gradient", GRADIENT,
     "outside_is_zero(d_log_scale, raw_scale, LOG_SCALE_LIMIT)", "d_log_scale",
     "project_backward_test", "ProjectBackward.parameters_beyond_their_limits_have_no_gradient"),
    ("log-scale of 50, opacity logit of 1e4", "opacity_limit_gradient", GRADIENT,
     "abs(logit) <= OPACITY_LOGIT_LIMIT ? sums.d_opacity * kept * o * rest : 0.0",
     "sums.d_opacity * kept * o * rest",
     "project_backward_test", "ProjectBackward.parameters_beyond_their_limits_have_no_gradient"),
    ("log-scale of 50, opacity logit of 1e4", "regulariser_limit", BACK,
     "if (abs(raw) <= LOG_SCALE_LIMIT) g.log_scale[c]", "g.log_scale[c]",
     "adam_update_test", "AdamUpdate.regularisers_leave_scales_beyond_their_limit"),
    ("splat that outgrows the scene where no photo looks", "largest_scale", BACK,
     "at_most(scale, max(scale_before, vec3(args.largest_log_scale)))", "scale",
     "adam_update_test", "AdamUpdate.no_scale_grows_beyond_the_largest"),
    ("splat on the path of the cameras, a veil between two photos", "clearance", BACK,
     "opacity_logit[i] -= FADING", "opacity_logit[i] -= 0.0",
     "adam_update_test", "AdamUpdate.splats_beside_the_camera_fade"),
    ("splat centre exactly on a pixel centre", "series_at_the_centre", "shaders/kernels/builtin.glsl",
     "s < 0.25 ? 1.0 - s * (1.0 / 6.0 - s * (1.0 / 120.0 - s * (1.0 / 5040.0))) : kernel_sin(x) / x", "sin(x) / x",
     "blend_test", "*sinc_psi_builtin:*mean_on_a_pixel_centre*"),
    ("splat centre exactly on a pixel centre", "steep_centre", "shaders/kernels/exponential.glsl",
     "v = q + EXPONENTIAL_SOFTENING", "v = q",
     "kernel_test", "KernelShader.*generalized_exponential*"),
    ("q within 1e-6 of the support's edge", "zero_beyond_the_edge", "shaders/kernels/builtin.glsl",
     "w = inside ? max(w, 0.0) : 0.0;", "w = max(w, 0.0);",
     "kernel_test", "KernelShader.CentreEdgeAndBeyond_areExact"),
    ("q within 1e-6 of the support's edge", "edge_mask", "shaders/kernels/compact.glsl",
     "min(q * k.inverse_support, 1.0)", "q * k.inverse_support",
     "kernel_test", "KernelShader.CentreEdgeAndBeyond_areExact"),
    ("q within 1e-6 of the support's edge", "edge_of_beta", "shaders/kernels/beta.glsl",
     "w = inside ? w : 0.0;", "",
     "kernel_test", "KernelShader.*beta*"),
    ("rings of sinc, which would be negative", "modulus_of_sinc", "shaders/kernels/builtin.glsl",
     "if (KERNEL_PULSES > 1 && w < 0.0)", "if (false)",
     "kernel_test", "KernelShader.Value_isThatOfDouble"),
    ("opacity at 1, thousands of opaque layers", "alpha_limit", BLEND,
     "min(light.w * kernel_value(x * x + y * y, exponent), ALPHA_MAX)", "light.w * kernel_value(x * x + y * y, exponent)",
     "blend_test", "every_kernel/Blend.opaque_stack_stops_before_the_transmittance_limit/gaussian_psi"),
    ("opacity at 1, thousands of opaque layers", "transmittance_stop", "shaders/forward/blend_pixels.glsl",
     "next >= MIN_TRANSMITTANCE;", "before >= 0.0;",
     "blend_test", "every_kernel/Blend.opaque_stack_stops_before_the_transmittance_limit/gaussian_psi"),
    ("opacity at 1, thousands of opaque layers", "alpha_limit_of_records", "shaders/forward/blend_batches.glsl",
     "min(record_alpha(r, offset, w, slope, by_exponent), ALPHA_MAX)", "record_alpha(r, offset, w, slope, by_exponent)",
     "blend_test", "every_kernel/Blend.opaque_stack_stops_before_the_transmittance_limit/gaussian_psi_records"),
    ("opacity at 1, thousands of opaque layers", "batch_with_an_end_again", "shaders/forward/blend_batches.glsl",
     "subgroupAny(least < MIN_TRANSMITTANCE)", "false",
     "blend_test", "BlendCases.records_end_every_pixel_where_the_other_form_does"),
    ("opacity at 1, thousands of opaque layers", "alpha_limit_gradient", SPLAT_SUMS,
     "mix(0.0, before * ahead, counts && raw < ALPHA_MAX)", "mix(0.0, before * ahead, counts)",
     "blend_backward_test", "BlendBackwardCases/EveryWay.alpha_at_its_limit_moves_only_the_colour/subgroup"),
    ("10,000 thin layers in one pixel", "gradient_ends_where_the_pixel_ended", BLEND_BACK,
     "px.d_colour[k], d_z, number <= px.last[k]);", "px.d_colour[k], d_z, true);",
     "blend_backward_test", "BlendBackwardCases/EveryWay.intersections_behind_the_stop_get_zero/subgroup"),
    ("10,000 thin layers in one pixel", "gradient_by_pixels_ends_too", "shaders/backward/pixel_moments.glsl",
     "r.number <= px.last[k]", "true",
     "blend_backward_test", "BlendBackwardCases/EveryWay.intersections_behind_the_stop_get_zero/pixels"),
    ("10,000 thin layers in one pixel", "what_is_behind", SPLAT_SUMS,
     "behind += alpha * ahead;", "",
     "blend_backward_test", "BlendBackwardCases/EveryWay.ten_thousand_thin_layers_match_double/subgroup"),
    ("a surface far away whose splats differ in the last digits of their depth", "depths_from_the_first_splat",
     "shaders/forward/blend_pixels.glsl",
     "depth -= first_depth[k];", "first_depth[k] = 0.0;",
     "blend_test", "BlendCases.spreads_of_depths_far_away_keep_their_digits"),
    ("a surface far away whose splats differ in the last digits of their depth", "depths_from_the_first_record",
     "shaders/forward/blend_batches.glsl",
     "depth -= firsts[k];", "firsts[k] = 0.0;",
     "blend_test", "BlendCases.spreads_of_depths_far_away_keep_their_digits"),
    ("equal depths, shuffled order", "stable_sort", "shaders/sort/radix_scatter_columns.comp",
     "for (uint i = begin; i < end; ++i) {", "for (uint i = end; i-- > begin;) {",
     "frame_test", "Frame.equal_depths_keep_file_order"),
    ("equal depths, shuffled order", "stable_lists", "shaders/sort/list_scatter.comp",
     "intersection_from_sorted[place + before] = j;", "intersection_from_sorted[place + count - 1u - before] = j;",
     "tile_lists_test", "TileLists.are_those_of_a_stable_sort"),
    ("equal depths, shuffled order", "stable_sort_by_ballots", "shaders/sort/radix_scatter_ballot.comp",
     "uint before = subgroupBallotExclusiveBitCount(peers);",
     "uint before = subgroupBallotBitCount(peers) - 1u - subgroupBallotExclusiveBitCount(peers);",
     "radix_sort_test", "*iota_values_are_the_stable_order*"),
    ("huge splats, a million splats in one tile", "long_lists", "shaders/forward/list_lengths.comp",
     "if (intersections > args.list_capacity)", "if (false)",
     "frame_passes_test", "ListLengths.*"),
    ("huge splats, a million splats in one tile", "more_intersections_than_room", "shaders/forward/frame_groups.comp",
     "if (total > args.intersection_capacity)", "if (false)",
     "frame_passes_test", "FrameGroups.more_intersections_than_room_raise_the_flag_and_are_cut"),
    ("huge splats, a million splats in one tile", "emission_within_the_buffers", "shaders/forward/emit_cell.glsl",
     "if (slot < args.intersection_capacity)", "if (true)",
     "frame_passes_test", "Emit.intersections_beyond_the_capacity_are_left_out"),
    ("huge splats, a million splats in one tile", "intersection_total_beyond_32_bits", "shaders/forward/emit.comp",
     "atomicOr(status.overflow, OVERFLOW_TOTAL);", "",
     "frame_passes_test", "Emit.a_total_beyond_32_bits_is_noted"),
    ("huge splats, a million splats in one tile", "overflow_changes_nothing", BACK,
     "|| status.overflow != 0u", "",
     "adam_update_test", "AdamUpdate.an_overflowed_frame_changes_nothing"),
    ("0 or 1 splats, none visible, all too faint", "empty_model", "trainer/growth/density_control.cpp",
     "if (n == 0) return result;", "",
     "densify_test", "Densify.an_empty_model_stays_empty"),
    ("coordinates at 1e6 m", "recentring", "engine/scene/edit_splats.cpp",
     "std::abs(median[axis]) > most * width", "false",
     "ply_test", "Ply.map_coordinates_keep_millimetres"),
    ("coordinates at 1e6 m", "recentring_of_points", "trainer/growth/initial_model.cpp",
     "choose_origin(points.position, kFarOff)", "glm::dvec3(0.0)",
     "initial_model_test", "InitialModel.map_coordinates_keep_millimetres"),
    ("coordinates at 1e6 m", "difference_before_rotation", COVARIANCE,
     "(p - camera.centre) - camera.centre_rest", "p - camera.centre",
     "hard_case_test", "every/HardCase.matches_double/floats_far_off_gaussian_psi"),
    ("odd image sizes, more than 65,536 tiles", "pixels_within_the_image", "shaders/forward/blend_state.glsl",
     """        if (at.x >= args.width || at.y >= args.height) continue;
        const uint o = at.y * args.width + at.x;
        const float transmittance""", """        const uint o = at.y * args.width + at.x;
        const float transmittance""",
     "blend_test", "BlendCases.image_sizes_that_are_no_multiple_of_a_tile_match_double"),
    ("odd image sizes, more than 65,536 tiles", "wide_tile_keys", "engine/raster/forward.cpp",
     "bits_for(args.tile_count),", "16,",
     "frame_test", "Frame.more_than_65536_tiles_are_told_apart"),
    ("NaN or infinity in a PLY, points or pose", "finite_splats", "engine/scene/ply.cpp",
     "if (!all_finite(values, columns)) return;", "",
     "ply_test", "Ply.splats_with_nan_or_infinity_are_dropped_and_counted"),
    ("NaN or infinity in a PLY, points or pose", "infinite_opacity", "engine/scene/splat_model.h",
     "std::isinf(logit) ?", "false ?",
     "ply_test", "Ply.infinite_opacity_and_no_extent_are_kept_at_the_limits"),
    ("NaN or infinity in a PLY, points or pose", "finite_points", "engine/data/colmap.cpp",
     "if (!finite) {", "if (file.empty()) {",
     "colmap_test", "ColmapBinary.nan_points_are_dropped_with_a_note"),
    ("NaN or infinity in a PLY, points or pose", "finite_pose", "engine/data/camera_list.cpp",
     "if (!std::isfinite(position.x + position.y + position.z))", "if (position.x > 1e300)",
     "colmap_test", "ColmapBinary.bad_records_are_errors_with_reason"),
    ("NaN or infinity in a PLY, points or pose", "finite_scale", PROJECT,
     " || any_nan(raw_scale)", "",
     "project_test", "Project.values_that_are_not_finite_are_culled_with_their_reason"),
    ("NaN or infinity in a PLY, points or pose", "finite_colour", PROJECT,
     "if (any_nan(signed_colour) || !magnitude_below(colour, 1e30)) return 0u;", "",
     "project_test", "Project.values_that_are_not_finite_are_culled_with_their_reason"),
    ("NaN or infinite gradient", "finite_gradient", BACK,
     "if (!finite(g)) {", "if (false) {",
     "adam_update_test", "AdamUpdate.a_gradient_that_is_not_finite_is_counted_and_skipped"),
    ("NaN or infinite gradient", "too_many_bad_gradients", "trainer/step/step.cpp",
     "if (bad * kBadGradientShare <= splats) return;", "if (splats > 0) return;",
     "trainer_test", "Training.more_bad_gradients_than_one_in_a_thousand_stop_the_run"),
    ("neighbours at distance 0, 1 point, no points", "least_distance", "engine/data/point_cloud_ply.cpp",
     "result[i] = std::max(kMinDistance2, sum", "result[i] = std::max(0.0, sum",
     "initial_model_test", "InitialModel.duplicate_points_have_a_finite_scale"),
    ("neighbours at distance 0, 1 point, no points", "no_points", "trainer/growth/initial_model.cpp",
     "return given_points(dataset, options).size() == 0;",
     "return given_points(dataset, options).size() == 1'000'000;",
     "initial_model_test", "InitialModel.no_points_become_random_ones"),
    ("Adam with v = 0 after a reset", "adam_epsilon", "shaders/optim/adam.glsl",
     "+ ADAM_EPSILON);", "+ 0.0);",
     "adam_update_test", "AdamUpdate.zero_moments_and_zero_gradient_move_nothing"),
    ("degenerate camera", "focal_length", "engine/data/lens_model.cpp",
     "for (int i = 0; i < (row->one_focal ? 1 : 2) && !lens.panorama(); ++i)", "for (int i = 0; i < 0; ++i)",
     "lens_test", "Lens.bad_parameters_are_errors"),
    ("degenerate camera", "orthonormal_rotation", "engine/data/camera_list.cpp",
     "<= kPoseTolerance))", "<= 1e300))",
     "transforms_test", "Transforms.bad_files_are_errors_that_name_the_frame"),
    ("degenerate camera", "photo_missing", "engine/data/colmap.cpp",
     "if (!fs::is_regular_file(view.photo) && missing++ == 0)", "if (false && missing++ == 0)",
     "colmap_test", "ColmapBinary.model_that_does_not_fit_together_is_an_error"),
    ("degenerate camera", "frame_without_photo", "engine/data/transforms.cpp",
     "if (view.photo.empty()) {", "if (root.empty()) {",
     "transforms_test", "TransformsSource.nerfstudio_folder_with_masks_points_and_split"),
]


def read(path, root=ROOT):
    with open(os.path.join(root, path), encoding="utf-8") as file:
        return file.read()


def test_sources():
    """-> {program: text}"""
    found = {}
    for folder, _, names in os.walk(os.path.join(ROOT, "tests")):
        for name in names:
            if name.endswith("_test.cpp"):
                found[name[:-4]] = read(os.path.join(folder, name))
    return found


def executable_of(program):
    """The test program that holds a test file, as tests/CMakeLists.txt defines it."""
    [folder] = [at for at, _, names in os.walk(os.path.join(ROOT, "tests")) if program + ".cpp" in names]
    kind = os.path.relpath(folder, os.path.join(ROOT, "tests"))
    if kind.startswith("unit/"):
        return f"{kind[len('unit/'):]}_unit_tests"
    alone = re.findall(r"set\((?:in_one_process|shares_a_run) ([^)]*)\)", read("tests/CMakeLists.txt"))
    return program if kind == "shader" or program in " ".join(alone).split() else f"{kind}_tests"


def case_table():
    lines = ["| case | guard | where | test that turns red without it |", "|---|---|---|---|"]
    before = None
    for case, name, path, _, _, program, test in GUARDS:
        shown = "" if case == before else case
        before = case
        lines.append(f"| {shown} | `{name}` | `{path}` | `{program}`: `{test}` |")
    return "\n".join(lines)


def between(text, name, new=None):
    """The text between a table's markers, or the whole page with that text replaced."""
    begin, end = f"<!-- {name} -->\n", f"<!-- end {name} -->"
    first, last = text.index(begin) + len(begin), text.index(end)
    return text[first:last].strip() if new is None else text[:first] + new + "\n" + text[last:]


def check():
    problems = []
    tests = test_sources()
    for _, name, path, held, without, program, test in GUARDS:
        if read(path).count(held) != 1:
            problems.append(f"guard {name}: {path} holds '{held}' {read(path).count(held)} times")
        if held == without:
            problems.append(f"guard {name}: nothing is disabled")
        words = [w for w in re.split(r"[*/.:]+", test) if len(w) > 3]
        text = tests.get(program, "")
        if not text or not any(w in text for w in words):
            problems.append(f"guard {name}: no test {test} in {program}")
        full = re.fullmatch(r"(?:\w+/)?(\w+)\.(\w+)(?:/\w+)?", test)
        if full and not re.search(rf"TEST\w*\({full[1]},\s*{full[2]}\)", text):
            problems.append(f"guard {name}: {program} has no TEST({full[1]}, {full[2]})")
    for page, tables in all_tables().items():
        for name, table in tables.items():
            if between(read(page), name) != table:
                problems.append(f"{page}: the table of {name} is out of date; run tools/lab/guards.py docs")
    errors = between(read(FIGURES), "errors")
    for name in re.findall(r'add\(\s*"(\w+)"', read("engine/check/hard_cases.cpp")):
        if f"| {name}" not in errors:
            problems.append(f"{FIGURES}: no errors of the case {name}; see tools/lab/truth_figures.py")
    print("\n".join(problems) or f"guards: {len(GUARDS)}, all in place")
    return 1 if problems else 0


def all_tables():
    """-> {page: {name of a table: text}}"""
    return {CASES: {"cases": case_table()}, FIGURES: truth_figures.tables()}


def write_docs():
    for page, tables in all_tables().items():
        docs = read(page)
        for name, table in tables.items():
            docs = between(docs, name, new=table)
        with open(os.path.join(ROOT, page), "w", encoding="utf-8") as file:
            file.write(docs)
    return 0


def shell(command, **more):
    return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False, **more)


def is_red(result, test):
    """A crash counts as red; no test run at all does not."""
    if "[==========] Running 0 tests" in result.stdout:
        sys.exit(f"no test matches {test}")
    return result.returncode != 0


def run(names):
    copy = os.path.join(ROOT, COPY)
    os.makedirs(copy, exist_ok=True)
    files = shell(["git", "ls-files", "-co", "--exclude-standard"], cwd=ROOT).stdout
    for name in files.splitlines():
        new, old = os.path.join(ROOT, name), os.path.join(copy, name)
        if os.path.isfile(new) and not (os.path.exists(old) and filecmp.cmp(new, old, shallow=False)):
            os.makedirs(os.path.dirname(old), exist_ok=True)
            shutil.copyfile(new, old)
    build = os.path.join(copy, "build")
    # With this, ccache, where there is one, finds the objects of the project's own build.
    os.environ.update(CCACHE_BASEDIR=copy, CCACHE_NOHASHDIR="1")
    made = shell(["cmake", "-G", "Ninja", "-S", copy, "-B", build, "-DCMAKE_BUILD_TYPE=Release", "-DCMAKE_UNITY_BUILD=ON"])
    if made.returncode:
        sys.exit(made.stdout)
    chosen = [g for g in GUARDS if not names or g[1] in names]
    failed = 0
    for _, name, path, held, without, program, test in chosen:
        target = os.path.join(copy, path)
        original = read(path, copy)
        with open(target, "w", encoding="utf-8") as file:
            file.write(original.replace(held, without))
        try:
            executable = executable_of(program)
            built = shell(["ninja", "-C", build, executable])
            if built.returncode:
                verdict = "FAIL: does not build\n" + built.stdout[-2000:]
            else:
                result = shell([os.path.join(build, "tests", executable), f"--gtest_filter={test}"], timeout=600)
                verdict = "red, as it must" if is_red(result, test) else "FAIL: still green"
        finally:
            with open(target, "w", encoding="utf-8") as file:
                file.write(original)
        failed += verdict.startswith("FAIL")
        print(f"{name}: {program} {test}: {verdict}", flush=True)
    print(f"{len(chosen)} guards, {failed} unwatched")
    return 1 if failed else 0


def main():
    if {"-h", "--help"} & set(sys.argv[1:]):
        print(__doc__.strip())
        return 0
    if len(sys.argv) > 1 and sys.argv[1] == "check":
        return check()
    if len(sys.argv) > 1 and sys.argv[1] == "docs":
        return write_docs()
    if len(sys.argv) > 1 and sys.argv[1] == "run":
        return run(sys.argv[2:])
    sys.exit(__doc__)


if __name__ == "__main__":
    sys.exit(main())
