#!/usr/bin/env bash
# The files that a new effect of the projection takes, as CONTRIBUTING.md lists them: those that are
# there now stand in no others. Prints one line per effect.
set -uo pipefail
cd "$(dirname "$0")/../.." || exit 1
failed=0

# check NAME WORDS OWN: files of the engine, the trainer, the viewer, the command and the shaders
# that hold one of the words (a regular expression); OWN: shader and rule files of its own.
check() {
    local allowed=(shaders/shared/effect_list.h engine/plan/effect_plan.cpp engine/raster/forward_options.h
        shaders/effects/constants.glsl)
    read -ra own <<<"$3"
    allowed+=("${own[@]}")
    local found others
    found=$(grep -rlwE --include='*.h' --include='*.cpp' --include='*.glsl' --include='*.comp' \
        "$2" engine trainer viewer tools/darb shaders | sort)
    others=$(comm -23 <(echo "$found") <(printf '%s\n' "${allowed[@]}" | sort))
    if [[ -z $others && ${#allowed[@]} -le 6 ]]; then
        echo "ok      $1: $(wc -l <<<"$found") files"
    else
        printf 'FAILED  %s: %s files allowed, and it is in\n%s\n' "$1" "${#allowed[@]}" "$others"
        failed=1
    fi
}

check near 'EFFECT_NEAR|near_care|NEAR_CARE' \
    'shaders/effects/camera_model.glsl engine/plan/effect_plan.cpp'
check off_centre 'EFFECT_OFF_CENTRE|off_centre|OFF_CENTRE' \
    'shaders/effects/camera_model.glsl engine/plan/effect_plan.cpp'

# The numbers of all others: where a command or a panel treats one apart.
for row in VIEW_COLOUR:10 ANTIALIAS:8 EXPOSURE:3 LENS:6 ALPHA:3 DEPTH:8 HUGE:6; do
    name=${row%:*}
    most=${row#*:}
    count=$(grep -rlw "EFFECT_$name" engine trainer viewer tools/darb shaders | wc -l)
    if ((count <= most)); then echo "ok      EFFECT_$name: $count files"; else
        echo "FAILED  EFFECT_$name: in $count files, at most $most before"
        failed=1
    fi
done
exit $failed
