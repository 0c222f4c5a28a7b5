# Embeds the files of kernels/ verbatim, by their paths in it, and lets clang check every kernel while building.

option(FATHOM_CHECK_KERNELS "Let clang check the kernels while building" ${PROJECT_IS_TOP_LEVEL})

set(FATHOM_CMAKE_DIR ${CMAKE_CURRENT_LIST_DIR})
cmake_path(SET FATHOM_KERNEL_DIR NORMALIZE ${CMAKE_CURRENT_LIST_DIR}/../kernels)
find_program(FATHOM_CLANG NAMES clang clang-19 clang-16 clang-15 clang-14 DOC "clang, which checks the kernels while building")

# Adds the text of files to a target, as `FUNCTION()`: path in a folder to content.
function(fathom_embed target function folder)
  set(files)
  foreach(file IN LISTS ARGN)
    cmake_path(ABSOLUTE_PATH file)
    list(APPEND files ${file})
  endforeach()
  set(embedded ${CMAKE_CURRENT_BINARY_DIR}/${function}.cpp)
  add_custom_command(OUTPUT ${embedded}
    COMMAND ${CMAKE_COMMAND} -D OUTPUT=${embedded} -D FUNCTION=${function} -D FOLDER=${folder} -D "FILES=${files}"
      -P ${FATHOM_CMAKE_DIR}/embed.cmake
    DEPENDS ${files} ${FATHOM_CMAKE_DIR}/embed.cmake VERBATIM COMMENT "Embedding ${function}")
  target_sources(${target} PRIVATE ${embedded})
endfunction()

function(fathom_embed_kernels target)
  file(GLOB_RECURSE files CONFIGURE_DEPENDS ${FATHOM_KERNEL_DIR}/*.cl ${FATHOM_KERNEL_DIR}/*.h)
  fathom_embed(${target} fathom_kernel_files ${FATHOM_KERNEL_DIR} ${files})
  if(FATHOM_CHECK_KERNELS)
    fathom_check_kernels(${target}_kernels_checked ${FATHOM_KERNEL_DIR})
  endif()
endfunction()

# Adds a target of the build in which clang checks every kernel of a folder again that changed, or whose headers did. The
# finite choices that a kernel is checked with stand in its head and in those of the headers: see check-kernel.sh.
function(fathom_check_kernels target folder)
  if(NOT FATHOM_CLANG)
    message(WARNING "clang is not here: the kernels are not checked while building (apt-get install clang)")
    return()
  endif()
  cmake_path(ABSOLUTE_PATH folder NORMALIZE)
  file(GLOB_RECURSE kernels CONFIGURE_DEPENDS ${folder}/*.cl)
  set(stamps)
  foreach(kernel IN LISTS kernels)
    cmake_path(GET kernel STEM name) # which no two kernels share: they are launched by it
    set(stamp ${CMAKE_CURRENT_BINARY_DIR}/${target}/${name})
    add_custom_command(OUTPUT ${stamp}
      COMMAND ${FATHOM_CMAKE_DIR}/check-kernel.sh ${FATHOM_CLANG} ${folder} ${kernel} ${stamp}
      DEPENDS ${kernel} ${FATHOM_CMAKE_DIR}/check-kernel.sh DEPFILE ${stamp}.d VERBATIM COMMENT "Checking the kernel ${name}")
    list(APPEND stamps ${stamp})
  endforeach()
  file(MAKE_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR}/${target})
  add_custom_target(${target} ALL DEPENDS ${stamps}) # beside the objects, which need not wait for it
endfunction()
