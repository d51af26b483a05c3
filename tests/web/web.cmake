# Tests of the page in a real browser (script/web-test installs the programs); skipped without one.
foreach(name campaign people queue vote restart sleep seats halt access archive everybody rigs live results recipes lab)
  add_test(NAME web_${name} COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/web/run ${name} $<TARGET_FILE:weftd> $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR})
  set_tests_properties(web_${name} PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 600 PROCESSORS 3)
endforeach()

# Pictures of every kind of report, from made-up results.
add_executable(report_pages ${CMAKE_CURRENT_SOURCE_DIR}/web/report_pages.cc)
target_link_libraries(report_pages PRIVATE weft_daemon_analysis_handover weft_daemon_analysis_design weft_daemon_analysis_calibration)
weft_test_code(report_pages)
add_test(NAME web_figures COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/web/run figures $<TARGET_FILE:report_pages> ${PROJECT_SOURCE_DIR}
         $<TARGET_FILE:weft>)
set_tests_properties(web_figures PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 600)
