// The table of splat formats, and the only switch between them. A row is a name: the file that
// reads or writes the format defines `const SplatFormatRow& <name>_format()`, all that is known of
// it (splat_format.h). The order is that in which content is recognised: .splat, which has nothing
// to know it by, comes last.
#pragma once

#define DARB_SPLAT_FORMATS(ROW) \
    ROW(ply)                    \
    ROW(compressed_ply)         \
    ROW(spz)                    \
    ROW(gltf)                   \
    ROW(streamed_sog)           \
    ROW(sog)                    \
    ROW(ksplat)                 \
    ROW(dot_splat)

namespace darb {

enum class SplatFormat {
#define DARB_SPLAT_FORMAT(name) name,
    DARB_SPLAT_FORMATS(DARB_SPLAT_FORMAT)
#undef DARB_SPLAT_FORMAT
};

}  // namespace darb
