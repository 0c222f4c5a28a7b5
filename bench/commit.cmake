# Writes OUTPUT, a C++ file whose fathom_commit() names the commit of SOURCE_DIR, when that has changed.
# What is only documentation does not count as a change: the bench writes there itself.
cmake_minimum_required(VERSION 3.25)
set(commit unknown)
execute_process(COMMAND git rev-parse --short=12 HEAD WORKING_DIRECTORY ${SOURCE_DIR}
  OUTPUT_VARIABLE head OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE failed)
if(NOT failed)
  set(commit ${head})
  execute_process(COMMAND git diff --quiet HEAD -- . ":!docs" ":!*.md" WORKING_DIRECTORY ${SOURCE_DIR}
    RESULT_VARIABLE changed ERROR_QUIET)
  if(changed)
    string(APPEND commit "+")
  endif()
endif()
file(CONFIGURE OUTPUT ${OUTPUT} CONTENT
  "const char* fathom_commit();\n\nconst char* fathom_commit() {\n    return \"@commit@\";\n}\n" @ONLY)
