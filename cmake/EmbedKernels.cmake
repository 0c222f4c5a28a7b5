# Embeds kernels/* verbatim, one array of bytes a file, and lets clang check every kernel while building.

set(FATHOM_CMAKE_DIR ${CMAKE_CURRENT_LIST_DIR})
set(FATHOM_KERNEL_DIR ${CMAKE_CURRENT_LIST_DIR}/../kernels)
find_program(FATHOM_CLANG NAMES clang clang-19 clang-16 clang-15 clang-14 DOC "clang, which checks the kernels while building")

# Adds the text of files to a target, as `FUNCTION()`: name to content.
function(fathom_embed target function)
  set(files)
  foreach(file IN LISTS ARGN)
    cmake_path(ABSOLUTE_PATH file)
    list(APPEND files ${file})
  endforeach()
  set(embedded ${CMAKE_CURRENT_BINARY_DIR}/${function}.cpp)
  add_custom_command(OUTPUT ${embedded}
    COMMAND ${CMAKE_COMMAND} -D OUTPUT=${embedded} -D FUNCTION=${function} -D "FILES=${files}"
      -P ${FATHOM_CMAKE_DIR}/embed.cmake
    DEPENDS ${files} ${FATHOM_CMAKE_DIR}/embed.cmake VERBATIM COMMENT "Embedding ${function}")
  target_sources(${target} PRIVATE ${embedded})
endfunction()

function(fathom_embed_kernels target)
  file(GLOB files CONFIGURE_DEPENDS ${FATHOM_KERNEL_DIR}/*.cl ${FATHOM_KERNEL_DIR}/*.h)
  fathom_embed(${target} fathom_kernel_files ${files})

  if(NOT FATHOM_CLANG)
    message(WARNING "clang is not here: the kernels are not checked while building (apt-get install clang)")
    return()
  endif()
  set(stamp ${CMAKE_CURRENT_BINARY_DIR}/kernels_checked)
  add_custom_command(OUTPUT ${stamp}
    COMMAND ${FATHOM_CMAKE_DIR}/check-kernels.sh ${FATHOM_CLANG} ${FATHOM_KERNEL_DIR}
    COMMAND ${CMAKE_COMMAND} -E touch ${stamp}
    DEPENDS ${files} ${FATHOM_CMAKE_DIR}/check-kernels.sh VERBATIM COMMENT "Checking the kernels with clang")
  add_custom_target(${target}_kernels_checked ALL DEPENDS ${stamp}) # beside the objects, which need not wait for it
endfunction()
