# What a machine at a bench needs: programs, manual pages, completion, the daemon's unit (cmake --install).
include(GNUInstallDirs)
set(weft_texts ${CMAKE_BINARY_DIR}/texts)
file(MAKE_DIRECTORY ${weft_texts})
add_custom_command(OUTPUT ${weft_texts}/weft.1 ${weft_texts}/weftd.1 ${weft_texts}/weft
                   COMMAND weft manual > ${weft_texts}/weft.1
                   COMMAND weftd --manual > ${weft_texts}/weftd.1
                   COMMAND weft completion > ${weft_texts}/weft
                   DEPENDS weft weftd VERBATIM)
add_custom_target(weft_texts ALL DEPENDS ${weft_texts}/weft.1)
# The unit names the programs where they are installed, which is known then (--prefix).
install(CODE "set(programs \"\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_BINDIR}\")
  configure_file(\"${PROJECT_SOURCE_DIR}/daemon/apps/weftd/weftd.service.in\" \"${weft_texts}/weftd.service\" @ONLY)" COMPONENT weft)
install(TARGETS weft weftd weft-rig COMPONENT weft)
install(FILES ${weft_texts}/weft.1 ${weft_texts}/weftd.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT weft)
install(FILES ${weft_texts}/weft DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions COMPONENT weft)
install(FILES packaging/prometheus.yml packaging/grafana-dashboard.json DESTINATION ${CMAKE_INSTALL_DATADIR}/weft COMPONENT weft)
install(FILES ${weft_texts}/weftd.service DESTINATION lib/systemd/system COMPONENT weft)
install(DIRECTORY recipes/library/ DESTINATION ${CMAKE_INSTALL_DATADIR}/weft/recipes COMPONENT weft FILES_MATCHING PATTERN *.json)
