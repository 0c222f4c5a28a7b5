# The build has no warnings; a consumer's build is not made to fail by a newer compiler's.
option(FATHOM_WERROR "Treat warnings as errors" ${PROJECT_IS_TOP_LEVEL})

function(fathom_warnings target)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wconversion)
  if(FATHOM_WERROR)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
endfunction()
