# Counts the cases of a run of ctest: prints how many passed, failed and were skipped. The first file is what ctest
# printed, the second its LastTest.log. A test of GoogleTest counts by its cases, any other as one.
NR == FNR {
    if (match($0, /Test +#[0-9]+: /)) {
        number = substr($0, RSTART, RLENGTH)
        gsub(/[^0-9]/, "", number)
        state[number] = /\*\*\*Skipped|\(Disabled\)/ ? "out" : / Passed +[0-9.]+ sec$/ ? "good" : "bad"
    }
    next
}
/^[0-9]+\/[0-9]+ Testing: / { number = $1 + 0 }
/^\[       OK \] .* ms\)$/ { ++good[number] }
/^\[  FAILED  \] .* ms\)$/ { ++bad[number] }
/^\[  SKIPPED \] .* ms\)$/ { ++out[number] }
END {
    for (t in state) {
        if (state[t] == "good" && good[t] + out[t] == 0) good[t] = 1
        if (state[t] == "bad" && bad[t] == 0) bad[t] = 1
        if (state[t] == "out" && out[t] == 0) out[t] = 1
        passed += good[t]; failed += bad[t]; skipped += out[t]
    }
    print passed + 0, failed + 0, skipped + 0
}
