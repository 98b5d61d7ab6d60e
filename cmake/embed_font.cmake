# SPDX-License-Identifier: MIT
# Run at build time: cmake -DOUT=FILE.cpp -DFONT=FILE.ttf -P embed_font.cmake writes FILE.cpp, which holds the font, or
# no font where the file does not exist. viewer/gui_font.h reads it.
set(bytes "")
if(EXISTS "${FONT}")
  file(READ "${FONT}" hex HEX)
  string(REGEX REPLACE "(..)" "0x\\1," bytes "${hex}")
endif()
file(WRITE ${OUT} "#include \"viewer/gui_font.h\"\n\nnamespace darb {\n\nnamespace {\n
const unsigned char kGuiFontBytes[] = {${bytes}0};  // the 0 is none of them\n
}  // namespace\n
std::span<const unsigned char> gui_font() {\n    return {kGuiFontBytes, sizeof kGuiFontBytes - 1};\n}\n
}  // namespace darb\n")
