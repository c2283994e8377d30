# Writes OUTPUT, the source file that holds the live page. ROOT: of the repository.
set(types_html "text/html; charset=utf-8")
set(types_css "text/css; charset=utf-8")
set(types_js "text/javascript; charset=utf-8")
set(entries "")

function(add path file)
  get_filename_component(ending ${file} LAST_EXT)
  string(SUBSTRING "${ending}" 1 -1 ending)
  file(READ ${file} text)
  string(APPEND entries "    {\"${path}\", \"${types_${ending}}\", R\"page(${text})page\"},\n")
  set(entries "${entries}" PARENT_SCOPE)
endfunction()

file(GLOB sources ${ROOT}/host_tools/view/page/*.html ${ROOT}/host_tools/view/page/*.css ${ROOT}/host_tools/view/page/*.js)
foreach(source IN LISTS sources)
  get_filename_component(name ${source} NAME)
  if(name STREQUAL "index.html")
    add("/" ${source})
  else()
    add("/${name}" ${source})
  endif()
endforeach()

execute_process(COMMAND ${ROOT}/scripts/install_node_packages host_tools/view/page_plots "uPlot, which draws the scope of the live page")
set(uplot ${ROOT}/build/page_plots/node_modules/uplot/dist)
set(has_plots false)
if(EXISTS ${uplot}/uPlot.esm.js)
  set(has_plots true)
  add("/uplot.js" ${uplot}/uPlot.esm.js)
  add("/uplot.css" ${uplot}/uPlot.min.css)
else()
  message("The live page shows values in place of its scope. With npm installed, remove ${OUTPUT} and build again.")
endif()

file(WRITE ${OUTPUT} "#include \"host_tools/view/server/page_files.hpp\"

namespace kmax::view {

std::span<const PageFile> page_files() {
  static constexpr PageFile files[] = {
${entries}  };
  return files;
}

bool page_has_plots() {
  return ${has_plots};
}

}  // namespace kmax::view
")
