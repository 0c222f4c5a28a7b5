# The build has no warnings; a consumer's build is not made to fail by a newer compiler's.
option(FATHOM_WERROR "Treat warnings as errors" ${PROJECT_IS_TOP_LEVEL})

function(fathom_warnings target)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wconversion)
  # False alarms of the optimiser: "text" + std::string (GCC bug 105651), std::vector::insert; copies of std::optional and
  # std::variant, in later versions too.
  if(CMAKE_CXX_COMPILER_ID STREQUAL GNU AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
    target_compile_options(${target} PRIVATE -Wno-restrict -Wno-stringop-overflow -Wno-array-bounds)
  endif()
  if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
    target_compile_options(${target} PRIVATE -Wno-maybe-uninitialized)
  endif()
  if(CMAKE_CXX_COMPILER_ID MATCHES Clang)
    target_compile_options(${target} PRIVATE -Wno-sign-conversion) # as GCC's -Wconversion in C++
  endif()
  if(FATHOM_WERROR)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
endfunction()
