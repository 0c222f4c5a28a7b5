# Runs a program under Oclgrind and fails on anything in its log: Oclgrind itself always exits with the program's status.
#   cmake -DOCLGRIND=... -DPROGRAM=... -DLANES=... -DLOG=... -P run.cmake

# Oclgrind 21.10 knows neither prefetches nor what forced inlining leaves behind. On optimised code it crashes if
# vectors have 16 lanes, or lacks functions that the code calls (funnel shifts). None of this changes results.
#
# Uninitialised reads are looked for with one lane: with 16 it takes the second operand of a shuffle for uninitialised. It takes
# memory that another buffer had before for uninitialised as well, so each group of kernels runs by itself. Left out are
# occlusion, whose filter reads sums outside the image on purpose, and blur, whose tables it takes for uninitialised.
set(build "-D__builtin_prefetch(pointer,write,locality)= -Dalways_inline= -cl-opt-disable")

function(watch)
  cmake_parse_arguments(PARSE_ARGV 0 arg "" "GROUP" "FOR")
  file(REMOVE ${LOG})
  execute_process(
    COMMAND ${OCLGRIND} ${arg_FOR} --build-options ${build} --log ${LOG} ${PROGRAM} ${LANES} ${arg_GROUP}
    OUTPUT_VARIABLE output ERROR_VARIABLE output RESULT_VARIABLE status)
  message("${output}")
  if(NOT status EQUAL 0 OR NOT output MATCHES "Oclgrind Simulator" OR NOT output MATCHES "[1-9][0-9]* images")
    message(FATAL_ERROR "the program did not run to its end on Oclgrind's device: ${status}")
  endif()
  file(READ ${LOG} log)
  string(STRIP "${log}" log)
  if(log)
    string(SUBSTRING "${log}" 0 4000 log)
    message(FATAL_ERROR "Oclgrind found:\n${log}")
  endif()
endfunction()

watch(FOR --data-races)
if(LANES EQUAL 1)
  foreach(group decode masks around normals noise fog)
    watch(GROUP ${group} FOR --uninitialized)
  endforeach()
endif()
