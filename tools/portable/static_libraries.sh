# SPDX-License-Identifier: MIT
# To be sourced, from the top of the source tree. Libraries that Debian has only as shared ones, or that its shared ones
# bring much else with, built from its source packages as static ones, without what darb does not use.

# shellcheck source=tools/portable/debian_sources.sh
. tools/portable/debian_sources.sh

# static_library PREFIX NAME OPTIONS...: builds one that debian_sources left in PREFIX/source.
static_library() {
    local prefix=$1 name=$2 source
    shift 2
    source=$(find "$prefix/source" -mindepth 1 -maxdepth 1 -type d -name "$name-*")
    if ! { cmake -S "$source" -B "$prefix/build/$name" -G Ninja -DCMAKE_BUILD_TYPE=Release -DBUILD_SHARED_LIBS=OFF \
        -DCMAKE_POSITION_INDEPENDENT_CODE=ON -DCMAKE_INSTALL_PREFIX="$prefix" -DCMAKE_INSTALL_LIBDIR=lib "$@" &&
        cmake --build "$prefix/build/$name" -j "${JOBS:-$(nproc)}" --target install; } >"$prefix/$name.log" 2>&1; then
        tail -30 "$prefix/$name.log" >&2
        exit 1
    fi
}

# static_libraries PREFIX ARRAY: builds them in PREFIX, once, and sets ARRAY to the options of cmake that choose them.
static_libraries() {
    local prefix=$1
    local -n chosen=$2
    if [[ ! -e $prefix/done ]]; then
        rm -rf "$prefix"
        debian_sources "$prefix" fmtlib/bookworm libzip/bookworm muparser/bookworm meshoptimizer/bookworm glfw3/trixie # GLFW 3.4 looks for X11 when it is used
        static_library "$prefix" fmtlib -DFMT_TEST=OFF -DFMT_DOC=OFF
        static_library "$prefix" libzip -DENABLE_{COMMONCRYPTO,GNUTLS,MBEDTLS,OPENSSL,BZIP2,LZMA}=OFF -DBUILD_{TOOLS,REGRESS,EXAMPLES,DOC}=OFF
        static_library "$prefix" muparser -DENABLE_{SAMPLES,OPENMP,WIDE_CHAR}=OFF
        static_library "$prefix" meshoptimizer
        static_library "$prefix" glfw3 -DGLFW_BUILD_{WAYLAND,EXAMPLES,TESTS,DOCS}=OFF
        touch "$prefix/done"
    fi
    # shellcheck disable=SC2034
    chosen=(-DDARB_FMT_LIBRARY="$prefix/lib/libfmt.a" -DZIP_LIBRARY="$prefix/lib/libzip.a"
        -DMUPARSER_LIBRARY="$prefix/lib/libmuparser.a" -DMESHOPTIMIZER_LIBRARY="$prefix/lib/libmeshoptimizer.a"
        -DDARB_GLFW_LIBRARY="$prefix/lib/libglfw3.a" -DSTB_LIBRARY=/usr/lib/x86_64-linux-gnu/libstb.a)
}
