# Embeds kernels/* verbatim, one array of bytes a file, and lets clang check every kernel while building.

set(FATHOM_KERNEL_DIR ${CMAKE_CURRENT_LIST_DIR}/../kernels)
find_program(FATHOM_CLANG NAMES clang clang-19 clang-16 clang-15 clang-14 DOC "clang, which checks the kernels while building")

function(fathom_embed_kernels target)
  file(GLOB files CONFIGURE_DEPENDS ${FATHOM_KERNEL_DIR}/*.cl ${FATHOM_KERNEL_DIR}/*.h)
  set(embedded ${CMAKE_CURRENT_BINARY_DIR}/embedded_kernels.cpp)
  add_custom_command(OUTPUT ${embedded}
    COMMAND ${CMAKE_COMMAND} -D OUTPUT=${embedded} -D "FILES=${files}" -P ${FATHOM_KERNEL_DIR}/../cmake/embed.cmake
    DEPENDS ${files} ${FATHOM_KERNEL_DIR}/../cmake/embed.cmake VERBATIM COMMENT "Embedding the kernels")
  target_sources(${target} PRIVATE ${embedded})

  if(NOT FATHOM_CLANG)
    message(WARNING "clang is not here: the kernels are not checked while building (apt-get install clang)")
    return()
  endif()
  set(stamp ${CMAKE_CURRENT_BINARY_DIR}/kernels_checked)
  add_custom_command(OUTPUT ${stamp}
    COMMAND ${FATHOM_KERNEL_DIR}/../cmake/check-kernels.sh ${FATHOM_CLANG} ${FATHOM_KERNEL_DIR}
    COMMAND ${CMAKE_COMMAND} -E touch ${stamp}
    DEPENDS ${files} ${FATHOM_KERNEL_DIR}/../cmake/check-kernels.sh VERBATIM COMMENT "Checking the kernels with clang")
  target_sources(${target} PRIVATE ${stamp})
endfunction()
