# SPDX-License-Identifier: MIT
# Run at build time: cmake -DOUT=FILE.cpp -DROOT=DIR -DFILES=a,b,c -P embed.cmake writes FILE.cpp, which holds the files
# (paths below DIR) as text, by name. engine/publish/page_files.h reads them.
string(REPLACE "," ";" names "${FILES}")
set(text "#include \"engine/publish/page_files.h\"\n\nnamespace darb {\n\nconst PageFile kPageFiles[] = {\n")
foreach(name ${names})
  file(READ ${ROOT}/${name} content)
  string(APPEND text "{\"${name}\", R\"page~(${content})page~\"},\n")
endforeach()
string(APPEND text "{{}, {}}};\n\n}  // namespace darb\n")
file(WRITE ${OUT} "${text}")
