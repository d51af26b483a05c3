# Tests that run a program of ours against another program or a whole scene. Exit status 77 means skipped.

add_executable(oracle_agreement ${CMAKE_CURRENT_SOURCE_DIR}/scenario/oracle_agreement.cc)
target_link_libraries(oracle_agreement PRIVATE weft_classifier)
add_test(NAME scenario_oracle_agreement
         COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/scenario/oracle_agreement.py
                 $<TARGET_FILE:oracle_agreement> ${PROJECT_SOURCE_DIR}/../shared)
set_tests_properties(scenario_oracle_agreement PROPERTIES SKIP_RETURN_CODE 77)
