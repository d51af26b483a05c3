# The page in a real browser (script/web-test installs what they need); without one they are skipped.
foreach(name campaign people queue vote restart sleep seats halt access archive everybody rigs live results recipes)
  add_test(NAME web_${name} COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/web/run ${name} $<TARGET_FILE:weftd> $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR})
  set_tests_properties(web_${name} PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 600 PROCESSORS 3)
endforeach()
