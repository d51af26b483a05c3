# Writes the page's files into one C++ source: cmake -DPAGE=FOLDER -DDYGRAPHS=FOLDER -DCODEMIRROR=FOLDER -DOUT=FILE -P embed.cmake
# Each file becomes an array of bytes. index.html is served as "/", other files by their path in FOLDER.
file(GLOB_RECURSE names RELATIVE ${PAGE} ${PAGE}/*)
list(SORT names)
set(type_html "text/html; charset=utf-8")
set(type_css "text/css; charset=utf-8")
set(type_js "text/javascript; charset=utf-8")
set(type_svg "image/svg+xml")

set(arrays "")
set(table "")
set(count 0)
function(embed file path)
  string(REGEX MATCH "[a-z]+$" ending ${path})
  if(path STREQUAL "index.html")
    set(ending html)
    set(path "")
  endif()
  if(NOT DEFINED type_${ending})
    message(FATAL_ERROR "embed.cmake: ${file}: no content type for files .${ending} (expected html, css, js or svg). Add a type_ variable")
  endif()
  file(READ ${file} bytes HEX)
  file(SHA256 ${file} digest)
  string(REGEX REPLACE "(................................)" "\\1\n" bytes "${bytes}")
  string(REGEX REPLACE "([0-9a-f][0-9a-f])" "'\\\\x\\1'," bytes "${bytes}")
  set(arrays "${arrays}constexpr char file_${count}[] = {\n${bytes}};\n" PARENT_SCOPE)
  set(table "${table}    {\"/${path}\", \"${type_${ending}}\", \"${digest}\", {file_${count}, sizeof file_${count}}},\n" PARENT_SCOPE)
  math(EXPR next "${count} + 1")
  set(count ${next} PARENT_SCOPE)
endfunction()

foreach(name ${names})
  embed(${PAGE}/${name} ${name})
endforeach()
embed(${DYGRAPHS}/dygraph.min.js lib/dygraph.min.js)
embed(${DYGRAPHS}/dygraph.min.css lib/dygraph.min.css)
embed(${CODEMIRROR}/lib/codemirror.js lib/codemirror.js)
embed(${CODEMIRROR}/lib/codemirror.css lib/codemirror.css)
embed(${CODEMIRROR}/mode/javascript/javascript.js lib/codemirror-javascript.js)

file(WRITE ${OUT} "#include \"daemon/service/web/web_files.hpp\"

namespace weft::daemon::web {
namespace {

${arrays}
constexpr WebFile files[] = {
${table}};

}  // namespace

std::span<const WebFile> web_files() { return files; }

}  // namespace weft::daemon::web
")
