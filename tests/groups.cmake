# Writes CTest's list of groups: all test cases of one file and one tier are one CTest test, which is one process.
#   cmake -DPROGRAM=fathom_tests -DOUTPUT=tests.cmake -P groups.cmake
# A tag says which tier a case belongs to: [exhaustive] runs in scripts/test --all only, [slow] is left out of
# scripts/test --quick. With -DCHECK=ON and -DCATCH_VERSION=... it fails unless each case of the program is in one group.
cmake_minimum_required(VERSION 3.25)

# Three specifications which together hold every case once.
set(spec_quick "~[slow]~[exhaustive]")
set(spec_slow "[slow]~[exhaustive]")
set(spec_exhaustive "[exhaustive]")

# Sets a variable to the lines that the program prints. Catch2 2 exits with the number of lines.
function(lines_of variable)
  execute_process(COMMAND ${PROGRAM} --filenames-as-tags ${ARGN}
    OUTPUT_VARIABLE output ERROR_VARIABLE errors RESULT_VARIABLE status)
  if(NOT status MATCHES "^[0-9]+$" OR NOT "${errors}" STREQUAL "")
    message(FATAL_ERROR "${PROGRAM} ${ARGN}: ${status}\n${output}${errors}")
  endif()
  string(REGEX REPLACE "[][;\\]" "|" output "${output}") # these characters mean something in CMake's lists
  string(REPLACE "\n" ";" output "${output}")
  list(REMOVE_ITEM output "")
  set(${variable} "${output}" PARENT_SCOPE)
endfunction()

set(text)
set(specs)
set(grouped 0)
foreach(tier quick slow exhaustive)
  lines_of(tags --list-tags "${spec_${tier}}")
  foreach(line IN LISTS tags)
    if(NOT line MATCHES "^ *([0-9]+) +\\|#(test_([^|]+))\\|")
      continue()
    endif()
    math(EXPR grouped "${grouped} + ${CMAKE_MATCH_1}")
    set(spec "[#${CMAKE_MATCH_2}]${spec_${tier}}")
    string(APPEND specs ",${spec}")
    set(name ${CMAKE_MATCH_3})
    set(timeout 300)
    set(cost)
    if(NOT tier STREQUAL quick)
      string(APPEND name "_${tier}")
      set(timeout 1800)
      set(cost "COST 100") # long ones first, so that no core waits for the last of them
    endif()
    string(APPEND text "add_test([[${name}]] [[${PROGRAM}]] --filenames-as-tags --durations yes [=[${spec}]=])\n"
      "set_tests_properties([[${name}]] PROPERTIES LABELS ${tier} TIMEOUT ${timeout} ${cost})\n")
  endforeach()
endforeach()

if(NOT CHECK)
  file(WRITE ${OUTPUT} "${text}")
  return()
endif()
set(names --list-test-names-only)
if(CATCH_VERSION VERSION_GREATER_EQUAL 3)
  set(names --list-tests --verbosity quiet)
endif()
string(SUBSTRING "${specs}" 1 -1 specs)
lines_of(all ${names})
lines_of(in_groups ${names} "${specs}")
list(LENGTH all count)
if(NOT "${all}" STREQUAL "${in_groups}" OR NOT count EQUAL grouped)
  message(FATAL_ERROR "the program has ${count} cases, but its groups have ${grouped}")
endif()
message("${count} test cases, each in one group")
