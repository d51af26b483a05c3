# Writes OUT, a header with the commit of the build (empty without git). The header changes only with the commit, so that nothing is rebuilt without need.
cmake_minimum_required(VERSION 3.25)
execute_process(COMMAND git -C ${SOURCE} rev-parse --short=12 HEAD OUTPUT_VARIABLE commit
                OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
execute_process(COMMAND git -C ${SOURCE} status --porcelain --untracked-files=no OUTPUT_VARIABLE changes
                ERROR_QUIET)
if(commit AND changes)
  string(APPEND commit ".modified")
endif()
file(CONFIGURE OUTPUT ${OUT} CONTENT "#pragma once\n#define WEFT_COMMIT \"@commit@\"\n" @ONLY)
