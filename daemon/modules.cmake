# The daemon's modules in eight layers, lowest first (see weft_module() in the top CMakeLists.txt and docs/explanation/architecture.md).

# base: time, text, files
weft_module(daemon/base/file USES protocols/base PRIVATE_SYSTEM OpenSSL::Crypto)
weft_module(daemon/base/text USES daemon/base/file protocols/base)
weft_module(daemon/base/version)
weft_module(daemon/base/loop USES drivers/api SYSTEM Threads::Threads)

# hardware: links, plugins and rig files, between drivers and ports
weft_module(daemon/hardware/link USES daemon/base/loop SYSTEM PkgConfig::SERIALPORT)
weft_module(daemon/hardware/plugins USES drivers/api SYSTEM ${CMAKE_DL_LIBS})
weft_module(daemon/hardware/rig USES daemon/base/file daemon/base/text daemon/hardware/link daemon/hardware/plugins recipes)

# storage: files
weft_module(daemon/storage/dataset USES daemon/base/file daemon/base/text daemon/base/version drivers/api classifier/features
            SYSTEM PkgConfig::HDF5 nlohmann_json::nlohmann_json PRIVATE_SYSTEM ZLIB::ZLIB)
weft_module(daemon/storage/recorder USES daemon/base/loop daemon/storage/dataset SYSTEM PkgConfig::SQLITE)
weft_module(daemon/storage/recordings USES daemon/storage/dataset classifier/vibro)
weft_module(daemon/storage/certificate USES daemon/storage/recorder daemon/storage/recordings)
weft_module(daemon/storage/imprints USES daemon/storage/dataset recipes classifier/imprint)

# campaign: one campaign from recipe to data set
weft_module(daemon/campaign/orders USES recipes)
weft_module(daemon/campaign USES daemon/campaign/orders daemon/hardware/rig daemon/storage/certificate classifier/live
            drivers/thorlabs_apt sim/rig)
weft_module(daemon/campaign/diagnostics USES daemon/campaign)
weft_module(daemon/campaign/setup USES daemon/campaign/diagnostics drivers/ati_digital drivers/ati_netft protocols/apt protocols/taxel protocols/vibro protocols/imprint)

# pages: SVG and HTML
weft_module(daemon/pages/plot USES daemon/base/text classifier/vibro)
weft_module(daemon/pages/document USES daemon/pages/plot SYSTEM nlohmann_json::nlohmann_json)

# analysis: computations and reports on existing data
weft_module(daemon/analysis/report USES daemon/storage/imprints daemon/campaign daemon/pages/document)
weft_module(daemon/analysis/tradeoff RECURSE USES daemon/campaign daemon/analysis/report daemon/pages/document daemon/storage/recordings classifier/live recipes
            sim/devices)
weft_module(daemon/analysis/calibration USES daemon/storage/dataset daemon/pages/document sim/plant SYSTEM Eigen3::Eigen)
weft_module(daemon/analysis/design USES daemon/analysis/report daemon/analysis/tradeoff classifier/design)
weft_module(daemon/analysis/imprint USES daemon/pages/document daemon/storage/imprints sim/plant)
weft_module(daemon/analysis/campaign_report USES daemon/analysis/design)
weft_module(daemon/analysis/handover USES daemon/analysis/report daemon/analysis/tradeoff daemon/analysis/imprint)

# service: the daemon over its API
weft_module(daemon/service/rpc USES daemon/storage/recorder recipes)
weft_module(daemon/service/client USES daemon/service/rpc PRIVATE_SYSTEM OpenSSL::SSL)
weft_module(daemon/service/web)
weft_module(daemon/service/transport USES daemon/service/rpc daemon/service/web PRIVATE_SYSTEM OpenSSL::SSL)
weft_module(daemon/service/run_model USES daemon/campaign/orders)
weft_module(daemon/service/run_store USES daemon/service/run_model daemon/campaign)
weft_module(daemon/service/runs USES daemon/service/run_store)
weft_module(daemon/service/handover USES daemon/service/run_store daemon/analysis/handover daemon/analysis/campaign_report)
weft_module(daemon/service/lab_agent USES daemon/service/lab daemon/service/runs)
weft_module(daemon/service/methods USES daemon/service/rpc daemon/service/runs daemon/service/handover daemon/service/lab_agent)
weft_module(daemon/service/notify USES daemon/service/runs PRIVATE_SYSTEM PkgConfig::CURL PkgConfig::MOSQUITTO)
weft_module(daemon/service/lab USES daemon/service/run_store recipes PRIVATE_SYSTEM PkgConfig::LIBPQ)
weft_module(daemon/service/daemon USES daemon/service/methods daemon/service/notify daemon/service/transport
            PRIVATE_SYSTEM spdlog::spdlog)

# apps: programs
weft_module(daemon/apps/weft USES daemon/service/daemon daemon/service/client daemon/service/lab daemon/analysis/campaign_report daemon/analysis/calibration daemon/campaign/diagnostics daemon/campaign/setup PRIVATE_SYSTEM PkgConfig::CURL)
weft_module(daemon/apps/weft_rig USES daemon/apps/weft)

set(WEFT_DAEMON_MODULES
    base/file base/text base/version base/loop hardware/link hardware/plugins hardware/rig
    storage/dataset storage/recorder storage/recordings storage/certificate storage/imprints campaign/orders campaign campaign/diagnostics campaign/setup pages/plot pages/document
    analysis/report analysis/tradeoff analysis/calibration analysis/design analysis/imprint analysis/campaign_report analysis/handover
    service/rpc service/client service/web service/transport service/run_model service/run_store service/runs
    service/handover service/methods service/notify service/lab service/lab_agent service/daemon
    apps/weft apps/weft_rig)
list(TRANSFORM WEFT_DAEMON_MODULES REPLACE "/" "_")
add_library(weft_daemon INTERFACE)  # all modules below apps
foreach(module ${WEFT_DAEMON_MODULES})
  get_target_property(kind weft_daemon_${module} TYPE)
  if(NOT kind STREQUAL INTERFACE_LIBRARY)
    weft_glue(weft_daemon_${module})
  endif()
  if(NOT module MATCHES "^apps_")
    target_link_libraries(weft_daemon INTERFACE weft_daemon_${module})
  endif()
endforeach()

target_include_directories(weft_daemon_service_transport SYSTEM PRIVATE ${BOOST_HEADERS})

# Not joined: their names or macros conflict with other sources in a unity build.
set_source_files_properties(daemon/hardware/link/serial_speed.cpp daemon/service/transport/http_request.cpp
                            daemon/service/transport/wire.cpp
                            daemon/base/version/software_version.cpp
                            PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)

# Version and commit are in one source, so that a new commit recompiles only that one.
target_compile_definitions(weft_daemon_base_version PRIVATE WEFT_VERSION="${PROJECT_VERSION}")
target_include_directories(weft_daemon_base_version PRIVATE ${CMAKE_BINARY_DIR}/generated)
add_custom_target(weft_build_stamp BYPRODUCTS ${CMAKE_BINARY_DIR}/generated/weft_build_stamp.hpp
                  COMMAND ${CMAKE_COMMAND} -DSOURCE=${PROJECT_SOURCE_DIR} -DOUT=${CMAKE_BINARY_DIR}/generated/weft_build_stamp.hpp
                          -P ${PROJECT_SOURCE_DIR}/daemon/base/version/build_stamp.cmake)
add_dependencies(weft_daemon_base_version weft_build_stamp)

# Built-in drivers.
target_sources(weft_daemon_hardware_plugins PRIVATE ${CMAKE_BINARY_DIR}/builtin_drivers_list.cpp)
target_link_libraries(weft_daemon_hardware_plugins PUBLIC ${WEFT_DRIVER_TARGETS})

if(WEFT_SNDFILE)
  target_include_directories(weft_daemon_storage_recordings SYSTEM PRIVATE ${SNDFILE_INCLUDE_DIRS})
  target_link_libraries(weft_daemon_storage_recordings PRIVATE ${CMAKE_DL_LIBS})
  set_property(SOURCE daemon/storage/recordings/sound_file.cpp APPEND PROPERTY COMPILE_DEFINITIONS WEFT_WITH_SNDFILE)
endif()

if(WEFT_NLOPT)
  target_include_directories(weft_daemon_analysis_calibration SYSTEM PRIVATE ${NLOPT_INCLUDE_DIRS})
  target_link_libraries(weft_daemon_analysis_calibration PRIVATE ${NLOPT_LINK_LIBRARIES})
  set_property(SOURCE daemon/analysis/calibration/minimise.cpp APPEND PROPERTY COMPILE_DEFINITIONS WEFT_WITH_NLOPT)
endif()

# The daemon serves the recipe's schema, so it is built in.
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS recipes/schema/recipe.schema.json)
file(READ recipes/schema/recipe.schema.json WEFT_RECIPE_SCHEMA)
configure_file(daemon/service/methods/recipe_schema.cpp.in ${CMAKE_BINARY_DIR}/recipe_schema.cpp @ONLY)
target_sources(weft_daemon_service_methods PRIVATE ${CMAKE_BINARY_DIR}/recipe_schema.cpp)

# The SQL of the laboratory's store is built in too.
file(GLOB lab_schema CONFIGURE_DEPENDS daemon/service/lab/schema/*.sql)
list(SORT lab_schema)
list(LENGTH lab_schema WEFT_LAB_MIGRATIONS)
set(WEFT_LAB_ROWS "")
foreach(file ${lab_schema})
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${file})
  get_filename_component(name ${file} NAME_WE)
  string(REGEX REPLACE "^0*([0-9]+)_.*" "\\1" version ${name})
  file(READ ${file} sql)
  string(APPEND WEFT_LAB_ROWS "{${version}, \"${name}\", R\"schema(${sql})schema\"},\n")
endforeach()
configure_file(daemon/service/lab/lab_schema.cpp.in ${CMAKE_BINARY_DIR}/lab_schema.cpp @ONLY)
target_sources(weft_daemon_service_lab PRIVATE ${CMAKE_BINARY_DIR}/lab_schema.cpp)

# The page is built in too, with Debian's libraries for charts and text (docs/adr/0003).
find_path(DYGRAPHS dygraph.min.js PATHS /usr/share/javascript/dygraphs NO_DEFAULT_PATH REQUIRED DOC "libjs-dygraphs: run script/bootstrap")
find_path(CODEMIRROR lib/codemirror.js PATHS /usr/share/javascript/codemirror NO_DEFAULT_PATH REQUIRED DOC "libjs-codemirror: run script/bootstrap")
file(GLOB_RECURSE web_page CONFIGURE_DEPENDS daemon/service/web/page/*)
add_custom_command(OUTPUT ${CMAKE_BINARY_DIR}/web_files_built_in.cpp
                   COMMAND ${CMAKE_COMMAND} -DPAGE=${PROJECT_SOURCE_DIR}/daemon/service/web/page -DDYGRAPHS=${DYGRAPHS} -DCODEMIRROR=${CODEMIRROR}
                           -DOUT=${CMAKE_BINARY_DIR}/web_files_built_in.cpp -P ${PROJECT_SOURCE_DIR}/daemon/service/web/embed.cmake
                   DEPENDS ${web_page} ${DYGRAPHS}/dygraph.min.js daemon/service/web/embed.cmake VERBATIM)
target_sources(weft_daemon_service_transport PRIVATE ${CMAKE_BINARY_DIR}/web_files_built_in.cpp)
set_source_files_properties(${CMAKE_BINARY_DIR}/web_files_built_in.cpp PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)

# Programs.
add_executable(weft daemon/apps/weft/weft.cc)
target_link_libraries(weft PRIVATE weft_daemon_apps_weft)
add_executable(weft-rig daemon/apps/weft_rig/weft_rig.cc)
target_link_libraries(weft-rig PRIVATE weft_daemon_apps_weft_rig)
add_executable(weftd daemon/apps/weftd/weftd.cc)
target_link_libraries(weftd PRIVATE weft_daemon_apps_weft)
foreach(program weft weft-rig weftd)
  weft_glue(${program})
endforeach()
include(daemon/apps/weftd/install.cmake)

if(WEFT_MPI)
  add_executable(weft-train-mpi daemon/apps/weft_train_mpi/train_mpi.cc)
  target_include_directories(weft-train-mpi SYSTEM PRIVATE ${MPI_INCLUDE_DIRS})
  target_link_libraries(weft-train-mpi PRIVATE weft_daemon_apps_weft ${MPI_LINK_LIBRARIES})
  weft_glue(weft-train-mpi)
endif()
