cmake_minimum_required(VERSION 3.25)
# One ctest entry for each gtest suite: run after PROGRAM was linked, writes OUT for ctest.
# (One for each test, as gtest_discover_tests makes them, would start hundreds of processes and build
# the fixtures that a suite shares again and again.)
execute_process(COMMAND ${PROGRAM} --gtest_list_tests
  OUTPUT_VARIABLE listing RESULT_VARIABLE code TIMEOUT 60)
if(NOT code EQUAL 0)
  message(FATAL_ERROR "${PROGRAM} --gtest_list_tests failed: ${code}")
endif()
# Suites are the lines without indentation ("Suite." or "Suite/0.  # TypeParam = ...").
string(REGEX MATCHALL "(^|\n)[A-Za-z_][A-Za-z0-9_/]*\\." suites "${listing}")
# Those that take minutes under a sanitizer begin early, so that no core is idle at the end.
set(long All/DeviceOps Readers/CutFiles TrainStages DeviceStages Team BenchmarkBuild Registration)
set(script "")
foreach(suite IN LISTS suites)
  string(REGEX REPLACE "^\n?(.*)\\.$" "\\1" suite "${suite}")
  if(suite MATCHES "DISABLED_")
    continue()
  endif()
  string(APPEND script
    "add_test([[${suite}]] [[${PROGRAM}]] [[--gtest_filter=${suite}.*]] [[--gtest_brief=1]])\n"
    "set_tests_properties([[${suite}]] PROPERTIES TIMEOUT 900)\n")
  if(suite IN_LIST long)
    string(APPEND script "set_tests_properties([[${suite}]] PROPERTIES COST 50)\n")
  endif()
endforeach()
if(script STREQUAL "")
  message(FATAL_ERROR "${PROGRAM} has no tests")
endif()
file(WRITE ${OUT} "${script}")
