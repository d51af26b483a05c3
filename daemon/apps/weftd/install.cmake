# Installs the files a bench machine needs (cmake --install): programs, manual pages, completion, the daemon's unit, rigs and recipes.
# Components are the packages of packaging/deb; docs/howto/install.md lists the contents of each.
include(GNUInstallDirs)
set(weft_texts ${CMAKE_BINARY_DIR}/texts)
file(MAKE_DIRECTORY ${weft_texts}/bash ${weft_texts}/zsh)
add_custom_command(OUTPUT ${weft_texts}/weft.1 ${weft_texts}/weftd.1 ${weft_texts}/weft-rig.1 ${weft_texts}/bash/weft ${weft_texts}/zsh/_weft
                          ${weft_texts}/bash/weftd ${weft_texts}/zsh/_weftd ${weft_texts}/bash/weft-rig ${weft_texts}/zsh/_weft-rig
                   COMMAND weft manual > ${weft_texts}/weft.1
                   COMMAND weftd --manual > ${weft_texts}/weftd.1
                   COMMAND weft-rig --manual > ${weft_texts}/weft-rig.1
                   COMMAND weft completion bash > ${weft_texts}/bash/weft
                   COMMAND weft completion zsh > ${weft_texts}/zsh/_weft
                   COMMAND weftd --completion bash > ${weft_texts}/bash/weftd
                   COMMAND weftd --completion zsh > ${weft_texts}/zsh/_weftd
                   COMMAND weft-rig --completion bash > ${weft_texts}/bash/weft-rig
                   COMMAND weft-rig --completion zsh > ${weft_texts}/zsh/_weft-rig
                   DEPENDS weft weftd weft-rig VERBATIM)
add_custom_target(weft_texts ALL DEPENDS ${weft_texts}/weft.1)

set(weft_share ${CMAKE_INSTALL_DATADIR}/weft)
install(TARGETS weft COMPONENT weft)
install(FILES ${weft_texts}/weft.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT weft)
# Installs the completion of a program for bash, and for zsh in the folder that Debian's zsh searches.
function(weft_install_completion program component)
  install(FILES ${weft_texts}/bash/${program} DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions COMPONENT ${component})
  install(FILES ${weft_texts}/zsh/_${program} DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions COMPONENT ${component})
endfunction()
weft_install_completion(weft weft)
weft_install_completion(weftd weftd)
weft_install_completion(weft-rig rig)
install(DIRECTORY recipes/library/ DESTINATION ${weft_share}/recipes COMPONENT weft FILES_MATCHING PATTERN *.json)
install(FILES recipes/schema/recipe.schema.json DESTINATION ${weft_share}/schema COMPONENT weft)
file(GLOB weft_tables sim/*.json)
install(FILES ${weft_tables} DESTINATION ${weft_share}/sim COMPONENT weft)
install(DIRECTORY sim/rigs/ DESTINATION ${weft_share}/sim/rigs COMPONENT weft FILES_MATCHING PATTERN *.json)

# Configured at install time, because the unit contains the prefix, which is known only then (--prefix).
install(CODE "set(programs \"\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_BINDIR}\")
  configure_file(\"${PROJECT_SOURCE_DIR}/daemon/apps/weftd/weftd.service.in\" \"${weft_texts}/weftd.service\" @ONLY)" COMPONENT weftd)
install(TARGETS weftd COMPONENT weftd)
install(FILES ${weft_texts}/weftd.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT weftd)
install(FILES ${weft_texts}/weftd.service DESTINATION lib/systemd/system COMPONENT weftd)
install(FILES packaging/prometheus.yml packaging/grafana-dashboard.json DESTINATION ${weft_share} COMPONENT weftd)

install(TARGETS weft-rig COMPONENT rig)
install(FILES ${weft_texts}/weft-rig.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT rig)
