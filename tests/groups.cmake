# Writes CTest's list of groups: all test cases of one file and one tier are one CTest test, which is one process.
#   cmake -DPROGRAM=fathom_tests -DOUTPUT=tests.cmake -P groups.cmake
# A tag says which tier a case belongs to: [exhaustive] runs in scripts/test --ci and --all only, and scripts/test --quick leaves
# out the tags of slow_tags and the files of long_files. What reads ../shared/data has the tag [real] and groups of their own,
# so that where the folder is absent all of a group is skipped, and nothing else. With -DCHECK=ON and -DCATCH_VERSION=... it fails unless each
# case of the program is in one group.
cmake_minimum_required(VERSION 3.25)

set(slow_tags [slow] [stability])

include(${CMAKE_CURRENT_LIST_DIR}/long_files.cmake)

# Files whose exhaustive cases take minutes, or gigabytes of memory or disk: scripts/test --all alone runs those.
set(all_only_files bench_cheapest cli_memory contract ssao_scene)

# Groups of slow cases that scripts/test leaves to --ci, or to --all: each takes more than half a minute where no kernel is
# compiled yet.
set(ci_only_groups contract_slow normals_slow regimes_slow)
set(all_only_groups cli_memory_slow cli_resume_slow io_ranking_slow real_ssao_exhaustive)

# Sets a variable to the specification of a tier, narrowed to a file by its tag. The four hold every case once.
function(spec_of variable tier file)
  if(tier STREQUAL exhaustive)
    set(spec "${file}[exhaustive]")
  elseif(tier STREQUAL real)
    set(spec "${file}[real]~[exhaustive]")
  elseif(tier STREQUAL slow)
    list(TRANSFORM slow_tags REPLACE "(.+)" "${file}\\1~[real]~[exhaustive]" OUTPUT_VARIABLE spec)
    list(JOIN spec "," spec)
  else()
    list(JOIN slow_tags "~" spec)
    set(spec "${file}~${spec}~[real]~[exhaustive]")
  endif()
  set(${variable} "${spec}" PARENT_SCOPE)
endfunction()

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

# OpenCV 4.6 leaves a CPU alone unless the environment asks for it, before OpenCV is first used.
set(environment_of_opencv_umat OPENCV_OPENCL_DEVICE=:CPU:)

set(text)
set(specs)
set(grouped 0)
foreach(tier quick slow real exhaustive)
  spec_of(spec ${tier} "")
  lines_of(tags --list-tags "${spec}")
  foreach(line IN LISTS tags)
    if(NOT line MATCHES "^ *([0-9]+) +\\|#(test_([^|]+))\\|")
      continue()
    endif()
    math(EXPR grouped "${grouped} + ${CMAKE_MATCH_1}")
    set(name ${CMAKE_MATCH_3})
    spec_of(spec ${tier} "[#${CMAKE_MATCH_2}]")
    string(APPEND specs ",${spec}")
    set(cost)
    set(environment)
    if(DEFINED environment_of_${name})
      set(environment "ENVIRONMENT [[${environment_of_${name}}]]")
    endif()
    set(label ${tier})
    if(tier STREQUAL quick AND name IN_LIST long_files)
      set(label standard)
    endif()
    if(tier STREQUAL exhaustive AND name IN_LIST all_only_files)
      set(label long)
    endif()
    if(tier STREQUAL real) # the images of test_real_* take a while, and so do programs
      set(label "real\;quick")
      if(name MATCHES "^(real|cli)_")
        set(label "real\;slow")
      endif()
    endif()
    if(NOT tier STREQUAL quick AND NOT name MATCHES "^${tier}_")
      string(APPEND name "_${tier}")
    endif()
    if(name IN_LIST ci_only_groups)
      set(label exhaustive)
    endif()
    if(name IN_LIST all_only_groups)
      set(label long)
    endif()
    if(NOT label MATCHES quick)
      set(cost "COST 100") # long ones first, so that no core waits for the last of them
    endif()
    string(APPEND text "add_test([[${name}]] [[${PROGRAM}]] --filenames-as-tags --durations yes [=[${spec}]=])\n"
      "set_tests_properties([[${name}]] PROPERTIES LABELS \"${label}\" TIMEOUT 1800 ${cost} ${environment})\n")
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
