# The build has no warnings; a consumer's build is not made to fail by a newer compiler's.
option(FATHOM_WERROR "Treat warnings as errors" ${PROJECT_IS_TOP_LEVEL})

function(fathom_warnings target)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wconversion)
  if(CMAKE_CXX_COMPILER_ID STREQUAL GNU AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
    target_compile_options(${target} PRIVATE -Wno-restrict) # GCC bug 105651: "text" + std::string at -O3
  endif()
  if(FATHOM_WERROR)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
endfunction()
