# Tests that run Weft's programs against other programs or in complete scenarios. Exit status 77 means skipped.

add_executable(oracle_agreement ${CMAKE_CURRENT_SOURCE_DIR}/scenario/oracle_agreement.cc)
target_link_libraries(oracle_agreement PRIVATE weft_classifier)
add_test(NAME scenario_oracle_agreement
         COMMAND ${WEFT_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/scenario/oracle_agreement.py
                 $<TARGET_FILE:oracle_agreement> ${PROJECT_SOURCE_DIR}/../shared $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR})
add_test(NAME scenario_oracle_agreement_cores
         COMMAND ${WEFT_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/scenario/oracle_agreement_cores.py
                 $<TARGET_FILE:oracle_agreement> ${PROJECT_SOURCE_DIR}/../shared $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR})
set_tests_properties(scenario_oracle_agreement scenario_oracle_agreement_cores
                     PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 600 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)

# Imprints: features, learning rules and tables.
add_executable(imprint_oracle ${CMAKE_CURRENT_SOURCE_DIR}/scenario/imprint_oracle.cc)
target_link_libraries(imprint_oracle PRIVATE weft_classifier)
add_test(NAME scenario_imprint_oracle
         COMMAND ${WEFT_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/scenario/imprint_oracle.py
                 $<TARGET_FILE:imprint_oracle> ${PROJECT_SOURCE_DIR}/../shared)
add_test(NAME scenario_cli_imprint
         COMMAND ${WEFT_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/scenario/cli_imprint.py $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR}/../shared)
add_test(NAME scenario_imprint_run
         COMMAND ${WEFT_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/scenario/imprint_run.py $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR})
set_tests_properties(scenario_imprint_oracle scenario_cli_imprint scenario_imprint_run PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 600 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)

# Sound and vibration: features, learners.
add_executable(vibro_agreement ${CMAKE_CURRENT_SOURCE_DIR}/scenario/vibro_agreement.cc)
target_link_libraries(vibro_agreement PRIVATE weft_classifier)
add_test(NAME scenario_vibro_agreement
         COMMAND ${WEFT_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/scenario/vibro_agreement.py
                 $<TARGET_FILE:vibro_agreement> ${PROJECT_SOURCE_DIR}/../shared)
add_executable(vibro_learners ${CMAKE_CURRENT_SOURCE_DIR}/scenario/vibro_learners.cc)
target_link_libraries(vibro_learners PRIVATE weft_classifier weft_bench_figures)
add_test(NAME scenario_vibro_learners
         COMMAND ${WEFT_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/scenario/vibro_learners.py
                 $<TARGET_FILE:vibro_learners> $<TARGET_FILE:vibro_agreement> ${PROJECT_SOURCE_DIR}/../shared)
# Skipped without librosa (PyPI), which no other test needs.
add_test(NAME scenario_vibro_librosa
         COMMAND ${WEFT_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/scenario/vibro_librosa.py
                 $<TARGET_FILE:vibro_agreement> ${PROJECT_SOURCE_DIR}/../shared)
set_tests_properties(scenario_vibro_agreement scenario_vibro_learners scenario_vibro_librosa
                     PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 300 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)

# The command line from a user's view.
set(cli_tests ${CMAKE_CURRENT_SOURCE_DIR}/scenario)
add_test(NAME scenario_cli_data COMMAND ${WEFT_PYTHON} ${cli_tests}/cli_data.py $<TARGET_FILE:weft>)
add_test(NAME scenario_cli_audit COMMAND ${WEFT_PYTHON} ${cli_tests}/cli_audit.py $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR} ${PROJECT_SOURCE_DIR}/../shared)
add_test(NAME nightly_cli_audit CONFIGURATIONS Nightly
         COMMAND ${WEFT_PYTHON} ${cli_tests}/cli_audit.py $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR} ${PROJECT_SOURCE_DIR}/../shared --seeds 20)
set_tests_properties(scenario_cli_audit nightly_cli_audit PROPERTIES TIMEOUT 900 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)
add_test(NAME scenario_cli_calibrate COMMAND ${WEFT_PYTHON} ${cli_tests}/cli_calibrate.py $<TARGET_FILE:weft>)
add_test(NAME scenario_cli_few_trials COMMAND ${WEFT_PYTHON} ${cli_tests}/cli_few_trials.py $<TARGET_FILE:weft>)
add_test(NAME scenario_cli_own_recordings COMMAND ${WEFT_PYTHON} ${cli_tests}/cli_own_recordings.py $<TARGET_FILE:weft>)
add_test(NAME scenario_cli_own_vibrations COMMAND ${WEFT_PYTHON} ${cli_tests}/cli_own_vibrations.py $<TARGET_FILE:weft>)
add_test(NAME scenario_cli_sound_and_axes COMMAND ${WEFT_PYTHON} ${cli_tests}/cli_sound_and_axes.py $<TARGET_FILE:weft>)
set_tests_properties(scenario_cli_sound_and_axes PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 300 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)
add_test(NAME scenario_cli_edges COMMAND ${WEFT_PYTHON} ${cli_tests}/cli_edges.py $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR} ${PROJECT_SOURCE_DIR}/../shared)
add_test(NAME scenario_cli_output COMMAND ${WEFT_PYTHON} ${cli_tests}/cli_output.py $<TARGET_FILE:weft>)
add_test(NAME scenario_cli_check
         COMMAND ${WEFT_PYTHON} ${cli_tests}/cli_check.py $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR})
add_test(NAME scenario_cli_run
         COMMAND ${WEFT_PYTHON} ${cli_tests}/cli_run.py $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR})
add_test(NAME scenario_cli_interrupt
         COMMAND ${WEFT_PYTHON} ${cli_tests}/cli_interrupt.py $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR})
add_test(NAME scenario_cli_watched
         COMMAND ${WEFT_PYTHON} ${cli_tests}/cli_watched.py $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR})
add_test(NAME scenario_cli_resume
         COMMAND ${WEFT_PYTHON} ${cli_tests}/cli_resume.py $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR})
# A campaign in parts and its merged data set.
add_test(NAME scenario_parts
         COMMAND ${WEFT_PYTHON} ${cli_tests}/parts.py $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR})
set_tests_properties(scenario_parts PROPERTIES TIMEOUT 300 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)
# A small file system that fills up; also for the daemon.
add_test(NAME scenario_full_disk COMMAND ${WEFT_PYTHON} ${cli_tests}/full_disk.py $<TARGET_FILE:weft>
         $<TARGET_FILE:weftd> ${PROJECT_SOURCE_DIR})
set_tests_properties(scenario_full_disk PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 300 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)
add_test(NAME scenario_cli_real_fabrics
         COMMAND ${WEFT_PYTHON} ${cli_tests}/cli_real_fabrics.py $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR}/../shared)
set_tests_properties(scenario_cli_data scenario_cli_calibrate scenario_cli_few_trials scenario_cli_own_recordings scenario_cli_own_vibrations scenario_cli_edges scenario_cli_output scenario_cli_check scenario_cli_run scenario_cli_interrupt scenario_cli_watched scenario_cli_resume PROPERTIES TIMEOUT 300)
# The parts that take minutes run only in the nightly preset.
add_test(NAME nightly_cli_real_fabrics CONFIGURATIONS Nightly
         COMMAND ${WEFT_PYTHON} ${cli_tests}/cli_real_fabrics.py $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR}/../shared --longer)
set_tests_properties(scenario_cli_real_fabrics nightly_cli_real_fabrics PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 900)
set_tests_properties(scenario_cli_data scenario_cli_calibrate scenario_cli_few_trials scenario_cli_own_recordings scenario_cli_own_vibrations scenario_cli_edges scenario_cli_output scenario_cli_check scenario_cli_run scenario_cli_interrupt scenario_cli_watched scenario_cli_resume
                     scenario_cli_real_fabrics nightly_cli_real_fabrics
                     PROPERTIES ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)

# Real recordings of sound and vibration, imported and evaluated.
add_test(NAME scenario_cli_recordings
         COMMAND ${WEFT_PYTHON} ${cli_tests}/cli_recordings.py $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR}/../shared)
set_tests_properties(scenario_cli_recordings PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 600 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)

# Twelve textures recorded on the simulated bench, from recipe to report.
add_test(NAME scenario_cli_vibrotactile
         COMMAND ${WEFT_PYTHON} ${cli_tests}/cli_vibrotactile.py $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR})
set_tests_properties(scenario_cli_vibrotactile PROPERTIES TIMEOUT 300 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)

# The largest published campaign: its textures, its check, and a cut of it.
add_test(NAME scenario_cli_textures118
         COMMAND ${WEFT_PYTHON} ${cli_tests}/cli_textures118.py $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR})
set_tests_properties(scenario_cli_textures118 PROPERTIES TIMEOUT 300 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)

# Accuracy on simulated data with the labels in random order.
add_test(NAME scenario_permuted_labels
         COMMAND ${WEFT_PYTHON} ${cli_tests}/permuted_labels.py $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR})
set_tests_properties(scenario_permuted_labels PROPERTIES TIMEOUT 300 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)

# LDA and SVC of the evaluator compared with scikit-learn.
add_test(NAME scenario_baselines_sklearn
         COMMAND ${WEFT_PYTHON} ${cli_tests}/baselines_sklearn.py $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR}/../shared)
set_tests_properties(scenario_baselines_sklearn PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 300
                     ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)

# Training shared by the ranks of an MPI job; skipped if MPI is not installed.
set(train_mpi "not built")
if(TARGET weft-train-mpi)
  set(train_mpi $<TARGET_FILE:weft-train-mpi>)
endif()
add_test(NAME scenario_train_mpi
         COMMAND ${WEFT_PYTHON} ${cli_tests}/train_mpi.py $<TARGET_FILE:weft> ${train_mpi})
set_tests_properties(scenario_train_mpi PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 300 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)

# Accuracy against time: fronts computed again from the JSON.
add_test(NAME scenario_cli_trade
         COMMAND ${WEFT_PYTHON} ${cli_tests}/cli_trade.py $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR})
add_test(NAME scenario_cli_report
         COMMAND ${WEFT_PYTHON} ${cli_tests}/cli_report.py $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR})
set_tests_properties(scenario_cli_trade scenario_cli_report PROPERTIES TIMEOUT 300 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)

# A sweep by one command: plan, heat maps in the report, analysis; a learning curve.
add_test(NAME scenario_cli_design
         COMMAND ${WEFT_PYTHON} ${cli_tests}/cli_design.py $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR})
set_tests_properties(scenario_cli_design PROPERTIES TIMEOUT 300 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)

# Every bit of the plant at each level, as digests: built with several compilers and compared by script/same-bytes.
add_executable(same_bytes EXCLUDE_FROM_ALL ${CMAKE_CURRENT_SOURCE_DIR}/scenario/same_bytes.cc)
target_link_libraries(same_bytes PRIVATE weft_sim_plant)
# The same for the training of the classifier.
add_executable(learnt_bytes EXCLUDE_FROM_ALL ${CMAKE_CURRENT_SOURCE_DIR}/scenario/learnt_bytes.cc)
target_link_libraries(learnt_bytes PRIVATE weft_classifier)

# The emulated bench: two programs, real ports, real time. It mostly waits, so it starts first.
add_test(NAME nightly_emulated_trial CONFIGURATIONS Nightly
         COMMAND ${WEFT_PYTHON} ${cli_tests}/emulated_trial.py $<TARGET_FILE:weft> $<TARGET_FILE:weft-rig> ${PROJECT_SOURCE_DIR})
set_tests_properties(nightly_emulated_trial PROPERTIES SKIP_RETURN_CODE 77 RUN_SERIAL ON TIMEOUT 900 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)

# Drivers as plugins: the same data, refusals, faulty plugins (one of them hangs for five seconds).
add_test(NAME scenario_plugins
         COMMAND ${WEFT_PYTHON} ${cli_tests}/plugins.py $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR}
                 ${PROJECT_BINARY_DIR}/plugins ${CMAKE_CURRENT_BINARY_DIR}/plugins)
set_tests_properties(scenario_plugins PROPERTIES TIMEOUT 300 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)

# weft doctor on rigs: simulated, emulated, broken, without hardware. A vibration sensor on a port in real time. The sample driver of docs/, built out
# of tree.
add_test(NAME scenario_doctor
         COMMAND ${WEFT_PYTHON} ${cli_tests}/doctor.py $<TARGET_FILE:weft> $<TARGET_FILE:weft-rig> ${PROJECT_SOURCE_DIR})
add_test(NAME scenario_box_pages
         COMMAND ${WEFT_PYTHON} ${cli_tests}/box_pages.py $<TARGET_FILE:weft> $<TARGET_FILE:weft-rig> ${PROJECT_SOURCE_DIR})
add_test(NAME scenario_echo_line
         COMMAND ${WEFT_PYTHON} ${cli_tests}/echo_line.py $<TARGET_FILE:weft> $<TARGET_FILE:weft-rig> ${PROJECT_SOURCE_DIR})
# libserialport, which opens no pseudo-terminal, on the same ports.
add_library(weft_real_port MODULE ${CMAKE_CURRENT_SOURCE_DIR}/scenario/real_port.c)
target_link_libraries(weft_real_port PRIVATE ${CMAKE_DL_LIBS})
add_test(NAME scenario_real_port COMMAND ${WEFT_PYTHON} ${cli_tests}/real_port.py $<TARGET_FILE:weft>
         $<TARGET_FILE:weft-rig> ${PROJECT_SOURCE_DIR} $<TARGET_FILE:weft_real_port>)
add_test(NAME scenario_vibro_ports
         COMMAND ${WEFT_PYTHON} ${cli_tests}/vibro_ports.py $<TARGET_FILE:weft> $<TARGET_FILE:weft-rig> ${PROJECT_SOURCE_DIR})
add_test(NAME scenario_sample_driver
         COMMAND ${WEFT_PYTHON} ${cli_tests}/sample_driver.py $<TARGET_FILE:weft> $<TARGET_FILE:weft-rig>
                 ${PROJECT_SOURCE_DIR} ${PROJECT_BINARY_DIR})
add_test(NAME scenario_sample_stage
         COMMAND ${WEFT_PYTHON} ${cli_tests}/sample_stage.py $<TARGET_FILE:weft> $<TARGET_FILE:weft-rig>
                 ${PROJECT_SOURCE_DIR} ${PROJECT_BINARY_DIR})
set_tests_properties(scenario_doctor scenario_box_pages scenario_echo_line scenario_sample_stage scenario_real_port scenario_vibro_ports scenario_sample_driver
                     PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 300 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)

# Clients written from the protocols' documents only, on the ports that weft-rig serves.
foreach(client apt netft)
  add_test(NAME scenario_${client}_client
           COMMAND ${WEFT_PYTHON} ${cli_tests}/${client}_client.py $<TARGET_FILE:weft-rig> ${PROJECT_SOURCE_DIR})
  set_tests_properties(scenario_${client}_client PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 300
                       ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)
endforeach()

# The same bench loses its host: killed in the stroke; in the nightly preset also at other times, and hung until the monitor ends it. Tests that
# regulate a force in real time must not run beside a computing program; a machine that is too slow is distinguished from a fault (machine_pace.py).
# So these share one test, and mostly wait: the killed host; a "real" rig file with weft-rig behind its ports; rigs with other stages and sensors; a
# rig file of devices that weft init found.
set(on_ports $<TARGET_FILE:weft> $<TARGET_FILE:weft-rig> ${PROJECT_SOURCE_DIR})
set(emulated_kill ${WEFT_PYTHON} ${cli_tests}/emulated_kill.py ${on_ports})
add_test(NAME scenario_real_time
         COMMAND ${WEFT_PYTHON} ${cli_tests}/side_by_side.py ${emulated_kill} 1 2
                 -- ${WEFT_PYTHON} ${cli_tests}/real_bench.py ${on_ports}
                 -- ${WEFT_PYTHON} ${cli_tests}/other_rigs.py $<TARGET_FILE:weft> $<TARGET_FILE:weftd> $<TARGET_FILE:weft-rig> ${PROJECT_SOURCE_DIR}
                 -- ${WEFT_PYTHON} ${cli_tests}/init.py ${on_ports} ports)
add_test(NAME nightly_emulated_kill CONFIGURATIONS Nightly COMMAND ${emulated_kill} 4 0)
set_tests_properties(scenario_real_time nightly_emulated_kill
                     PROPERTIES SKIP_RETURN_CODE 77 RUN_SERIAL ON TIMEOUT 900 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)

# Rig files of the simulated shapes.
add_test(NAME scenario_init_simulated COMMAND ${WEFT_PYTHON} ${cli_tests}/init.py ${on_ports} simulated)
set_tests_properties(scenario_init_simulated PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 600 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)

# Every device on TCP too; hosts that disconnect in the middle of a message.
add_test(NAME scenario_rig_tcp
         COMMAND ${WEFT_PYTHON} ${cli_tests}/rig_tcp.py $<TARGET_FILE:weft> $<TARGET_FILE:weft-rig> ${PROJECT_SOURCE_DIR})
set_tests_properties(scenario_rig_tcp PROPERTIES TIMEOUT 120 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)

# Only one program at a time may use a device; the doctor makes the same checks as a run.
add_test(NAME scenario_device_locks
         COMMAND ${WEFT_PYTHON} ${cli_tests}/device_locks.py $<TARGET_FILE:weft> $<TARGET_FILE:weft-rig> ${PROJECT_SOURCE_DIR})
set_tests_properties(scenario_device_locks PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 600 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)

# Signals other than SIGKILL, a killed monitor, a limited file size; files locked by other programs.
add_test(NAME scenario_host_signals
         COMMAND ${WEFT_PYTHON} ${cli_tests}/host_signals.py $<TARGET_FILE:weft> $<TARGET_FILE:weft-rig> ${PROJECT_SOURCE_DIR})
add_library(weft_poor_disk MODULE ${CMAKE_CURRENT_SOURCE_DIR}/scenario/poor_disk.c)
target_link_libraries(weft_poor_disk PRIVATE ${CMAKE_DL_LIBS})
add_test(NAME scenario_files_in_use COMMAND ${WEFT_PYTHON} ${cli_tests}/files_in_use.py $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR}
         $<TARGET_FILE:weft_poor_disk>)
set_tests_properties(scenario_host_signals scenario_files_in_use
                     PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 600 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)

# Badly written hosts: leaving silently, reading nothing, requesting everything, two at once.
add_test(NAME scenario_rig_hosts
         COMMAND ${WEFT_PYTHON} ${cli_tests}/rig_hosts.py $<TARGET_FILE:weft-rig> ${PROJECT_SOURCE_DIR})
set_tests_properties(scenario_rig_hosts PROPERTIES TIMEOUT 180 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)

# Third-party Modbus programs against the emulated Digital F/T sensor.
pkg_check_modules(MODBUS IMPORTED_TARGET libmodbus)
if(MODBUS_FOUND)
  add_executable(libmodbus_client ${CMAKE_CURRENT_SOURCE_DIR}/scenario/libmodbus_client.cc)
  target_link_libraries(libmodbus_client PRIVATE PkgConfig::MODBUS)
  set(modbus_clients ${WEFT_PYTHON} ${cli_tests}/modbus_clients.py $<TARGET_FILE:weft> $<TARGET_FILE:weft-rig>
      $<TARGET_FILE:libmodbus_client> ${PROJECT_SOURCE_DIR})
  add_test(NAME scenario_modbus_clients COMMAND ${modbus_clients})
  add_test(NAME nightly_modbus_clients CONFIGURATIONS Nightly COMMAND ${modbus_clients} --longer)
  set_tests_properties(scenario_modbus_clients nightly_modbus_clients
                       PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 600 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)
  set_tests_properties(nightly_modbus_clients PROPERTIES RUN_SERIAL ON)
endif()

# Programs from PyPI drive the whole emulated bench; their virtual environment stays in the build tree.
add_test(NAME scenario_pypi_clients
         COMMAND ${WEFT_PYTHON} ${cli_tests}/pypi_clients.py $<TARGET_FILE:weft-rig> ${PROJECT_SOURCE_DIR} ${PROJECT_BINARY_DIR}/pypi_clients)
set_tests_properties(scenario_pypi_clients PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 400 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)
# Bluesky and ophyd-async from PyPI run plans on the simulated rig through the Python client.
add_test(NAME scenario_bluesky_rig
         COMMAND ${WEFT_PYTHON} ${cli_tests}/bluesky_rig.py $<TARGET_FILE:weftd> ${PROJECT_SOURCE_DIR} ${PROJECT_BINARY_DIR}/bluesky_rig)
set_tests_properties(scenario_bluesky_rig PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 400 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)
# Tiled from PyPI serves a finished data set.
add_test(NAME scenario_tiled_server
         COMMAND ${WEFT_PYTHON} ${cli_tests}/tiled_server.py $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR} ${PROJECT_BINARY_DIR}/tiled_server)
set_tests_properties(scenario_tiled_server PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 400 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)

# The Python client's arrays and exports, and the plots of its notebook, with packages from PyPI; their virtual environment stays in the build tree.
add_test(NAME scenario_python_data
         COMMAND ${WEFT_PYTHON} ${cli_tests}/python_data.py $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR} ${PROJECT_BINARY_DIR}/python_data)
add_test(NAME scenario_python_notebook
         COMMAND ${WEFT_PYTHON} ${cli_tests}/python_notebook.py $<TARGET_FILE:weftd> ${PROJECT_SOURCE_DIR} ${PROJECT_BINARY_DIR}/python_data)
add_test(NAME scenario_python_vibration
         COMMAND ${WEFT_PYTHON} ${cli_tests}/python_vibration.py $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR} ${PROJECT_BINARY_DIR}/python_data)
set_tests_properties(scenario_python_data scenario_python_notebook scenario_python_vibration
                     PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 400 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)

# The daemon over its socket: a run is started, paused, resumed, halted and killed, with the standard library only.
add_test(NAME scenario_weftd_runs
         COMMAND ${WEFT_PYTHON} ${cli_tests}/weftd_runs.py $<TARGET_FILE:weftd> $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR})
add_test(NAME scenario_weftd_http
         COMMAND ${WEFT_PYTHON} ${cli_tests}/weftd_http.py $<TARGET_FILE:weftd> $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR})
# Operator steps between trials, and their confirmation.
add_test(NAME scenario_weftd_people
         COMMAND ${WEFT_PYTHON} ${cli_tests}/weftd_people.py $<TARGET_FILE:weftd> $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR})
# Waiting runs, and runs interrupted by the daemon's death.
add_test(NAME scenario_weftd_queue
         COMMAND ${WEFT_PYTHON} ${cli_tests}/weftd_queue.py $<TARGET_FILE:weftd> $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR})
# Ends of runs: nothing moves before a person allows it.
add_test(NAME scenario_weftd_stops
         COMMAND ${WEFT_PYTHON} ${cli_tests}/weftd_stops.py $<TARGET_FILE:weftd> $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR})
add_test(NAME scenario_weftd_samples
         COMMAND ${WEFT_PYTHON} ${cli_tests}/weftd_samples.py $<TARGET_FILE:weftd> ${PROJECT_SOURCE_DIR})
add_test(NAME scenario_weftd_faults COMMAND ${WEFT_PYTHON} ${cli_tests}/weftd_faults.py $<TARGET_FILE:weftd> $<TARGET_FILE:weft>
         ${PROJECT_SOURCE_DIR})
# Work in progress when the daemon gets the signal to end.
add_test(NAME scenario_weftd_end COMMAND ${WEFT_PYTHON} ${cli_tests}/weftd_end.py $<TARGET_FILE:weftd> ${PROJECT_SOURCE_DIR})
add_test(NAME scenario_weftd_motion
         COMMAND ${WEFT_PYTHON} ${cli_tests}/weftd_motion.py $<TARGET_FILE:weftd> $<TARGET_FILE:weft> $<TARGET_FILE:weft-rig> ${PROJECT_SOURCE_DIR})
# The daemon under a service manager: reload, watchdog, its journal on standard output, refused tokens.
add_test(NAME scenario_weftd_process
         COMMAND ${WEFT_PYTHON} ${cli_tests}/weftd_process.py $<TARGET_FILE:weftd> $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR})
set_tests_properties(scenario_weftd_process PROPERTIES SKIP_RETURN_CODE 77)
set_tests_properties(scenario_weftd_people scenario_weftd_queue scenario_weftd_stops scenario_weftd_samples scenario_weftd_faults scenario_weftd_end scenario_weftd_motion scenario_weftd_process PROPERTIES TIMEOUT 300 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)
# Live votes during a stroke, and strokes that end with them.
add_test(NAME scenario_weftd_live
         COMMAND ${WEFT_PYTHON} ${cli_tests}/weftd_live.py $<TARGET_FILE:weftd> $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR})
set_tests_properties(scenario_weftd_live PROPERTIES TIMEOUT 300 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)
# The handover of a complete campaign starts by itself.
add_test(NAME scenario_weftd_handover
         COMMAND ${WEFT_PYTHON} ${cli_tests}/weftd_handover.py $<TARGET_FILE:weftd> $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR})
# Plans, differences of recipes, and a data set's files over HTTP.
add_test(NAME scenario_weftd_data
         COMMAND ${WEFT_PYTHON} ${cli_tests}/weftd_data.py $<TARGET_FILE:weftd> $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR})
# Results for people: accuracy, report, tables of samples, trials, tags and notes.
add_test(NAME scenario_weftd_trials
         COMMAND ${WEFT_PYTHON} ${cli_tests}/weftd_trials.py $<TARGET_FILE:weftd> $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR})
set_tests_properties(scenario_weftd_handover scenario_weftd_data scenario_weftd_trials PROPERTIES TIMEOUT 600 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)

# The list of runs damaged, lost and rebuilt; many runs one after the other, thousands of them in the nightly preset.
add_test(NAME scenario_weftd_catalogue
         COMMAND ${WEFT_PYTHON} ${cli_tests}/weftd_catalogue.py $<TARGET_FILE:weftd> $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR})
set(weftd_soak ${WEFT_PYTHON} ${cli_tests}/weftd_soak.py $<TARGET_FILE:weftd> $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR})
add_test(NAME scenario_weftd_soak COMMAND ${weftd_soak} 120)
add_test(NAME nightly_weftd_soak CONFIGURATIONS Nightly COMMAND ${weftd_soak} 5000)
set_tests_properties(scenario_weftd_catalogue scenario_weftd_soak PROPERTIES TIMEOUT 300 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)
set_tests_properties(nightly_weftd_soak PROPERTIES TIMEOUT 7200 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)
# The rigs of sound and vibration and of imprints under weftd.
add_test(NAME scenario_weftd_other_systems
         COMMAND ${WEFT_PYTHON} ${cli_tests}/weftd_other_systems.py $<TARGET_FILE:weftd> $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR})
set_tests_properties(scenario_weftd_other_systems PROPERTIES TIMEOUT 300 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)
# Notifications by a webhook and a broker, and the metrics for Prometheus.
set(notify_test ${WEFT_PYTHON} ${cli_tests}/weftd_notify.py $<TARGET_FILE:weftd> $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR})
add_test(NAME scenario_weftd_notify COMMAND ${notify_test})
add_test(NAME nightly_weftd_promtool CONFIGURATIONS Nightly COMMAND ${notify_test} --promtool)
set_tests_properties(scenario_weftd_notify nightly_weftd_promtool
                     PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 300 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)
# The machine's wall clock set forward and back.
add_library(weft_shifted_clock MODULE ${CMAKE_CURRENT_SOURCE_DIR}/scenario/shifted_clock.c)
add_test(NAME scenario_weftd_clock
         COMMAND ${WEFT_PYTHON} ${cli_tests}/weftd_clock.py $<TARGET_FILE:weftd> $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR}
                 $<TARGET_FILE:weft_shifted_clock>)
set_tests_properties(scenario_weftd_clock PROPERTIES TIMEOUT 300 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)
# TLS, with a generated certificate.
add_test(NAME scenario_weftd_access
         COMMAND ${WEFT_PYTHON} ${cli_tests}/weftd_access.py $<TARGET_FILE:weftd> $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR})
set_tests_properties(scenario_weftd_access PROPERTIES TIMEOUT 300 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)

add_test(NAME scenario_weftd_tls
         COMMAND ${WEFT_PYTHON} ${cli_tests}/weftd_tls.py $<TARGET_FILE:weftd> $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR})
set_tests_properties(scenario_weftd_tls PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 300 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)
# docs/reference/api.md against the daemon's own document; its examples are run.
add_test(NAME scenario_api_document
         COMMAND ${WEFT_PYTHON} ${cli_tests}/api_document.py $<TARGET_FILE:weftd> ${PROJECT_SOURCE_DIR})
set_tests_properties(scenario_api_document PROPERTIES SKIP_RETURN_CODE 77)
set_tests_properties(scenario_weftd_runs scenario_weftd_http scenario_api_document PROPERTIES TIMEOUT 600 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)

# The Python client: its units, its types, its generated part against the daemon's document; installed by pip and used, with its notebook. The
# examples of other languages.
set(python_client ${PROJECT_SOURCE_DIR}/clients/python)
add_test(NAME unit_python_client COMMAND ${WEFT_PYTHON} -m unittest discover -s ${python_client}/tests -t ${python_client}/tests)
set_tests_properties(unit_python_client PROPERTIES TIMEOUT 120 ENVIRONMENT "PYTHONDONTWRITEBYTECODE=1;PYTHONPATH=${python_client}/src")
add_test(NAME scenario_python_client_methods
         COMMAND ${WEFT_PYTHON} ${cli_tests}/python_client_methods.py $<TARGET_FILE:weftd> ${PROJECT_SOURCE_DIR})
add_test(NAME scenario_python_client
         COMMAND ${WEFT_PYTHON} ${cli_tests}/python_client.py $<TARGET_FILE:weftd> $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR})
add_test(NAME scenario_other_clients
         COMMAND ${WEFT_PYTHON} ${cli_tests}/other_clients.py $<TARGET_FILE:weftd> $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR})
set_tests_properties(scenario_python_client_methods scenario_python_client scenario_other_clients
                     PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 600 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)
# Its pytest plugin: the repository of docs/howto/ci.md, with pytest from PyPI in a virtual environment of the build tree.
add_test(NAME scenario_pytest_plugin
         COMMAND ${WEFT_PYTHON} ${cli_tests}/pytest_plugin.py $<TARGET_FILE_DIR:weftd> ${PROJECT_SOURCE_DIR} ${PROJECT_BINARY_DIR}/pytest_plugin)
set_tests_properties(scenario_pytest_plugin PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 400 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)
# Its wheel with the oldest promised Python, this one and the newest on the machine; WEFT_PYTHONS names others.
add_test(NAME scenario_python_versions
         COMMAND ${WEFT_PYTHON} ${cli_tests}/python_versions.py $<TARGET_FILE:weftd> $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR}
                 ${PROJECT_BINARY_DIR}/python_versions --core)
# The packages of three versions are 2 GB.
add_test(NAME nightly_python_versions CONFIGURATIONS Nightly
         COMMAND ${WEFT_PYTHON} ${cli_tests}/python_versions.py $<TARGET_FILE:weftd> $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR}
                 ${PROJECT_BINARY_DIR}/python_versions)
set_tests_properties(scenario_python_versions nightly_python_versions PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 900 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)
# Its types: mypy from PyPI over sources, extras and programs that use the wheel.
add_test(NAME lint_python_client_types
         COMMAND ${WEFT_PYTHON} ${cli_tests}/python_types.py ${PROJECT_SOURCE_DIR} ${PROJECT_BINARY_DIR}/python_types)
set_tests_properties(lint_python_client_types PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 400 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)

# Pages for people: every command in them is run; the reference must match the schemas and programs.
add_test(NAME scenario_docs_commands COMMAND ${WEFT_PYTHON} ${cli_tests}/docs_commands.py ${PROJECT_BINARY_DIR} ${PROJECT_SOURCE_DIR})
add_test(NAME scenario_reference_pages
         COMMAND ${WEFT_PYTHON} ${cli_tests}/reference_pages.py $<TARGET_FILE:weft> $<TARGET_FILE:weftd> $<TARGET_FILE:weft-rig>
                 ${PROJECT_SOURCE_DIR})
set_tests_properties(scenario_docs_commands scenario_reference_pages PROPERTIES TIMEOUT 300 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)

# The plate's tilt is measured by contact and compensated: simulated, on ports in real time, and in cases that must fail.
add_test(NAME scenario_align
         COMMAND ${WEFT_PYTHON} ${cli_tests}/align.py $<TARGET_FILE:weft> $<TARGET_FILE:weft-rig> ${PROJECT_SOURCE_DIR})
add_test(NAME nightly_align_on_ports CONFIGURATIONS Nightly
         COMMAND ${WEFT_PYTHON} ${cli_tests}/align.py $<TARGET_FILE:weft> $<TARGET_FILE:weft-rig> ${PROJECT_SOURCE_DIR} --ports)
set_tests_properties(scenario_align nightly_align_on_ports PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 600 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)
set_tests_properties(nightly_align_on_ports PROPERTIES RUN_SERIAL ON)

# The same daemon among broken and hostile clients.
add_test(NAME scenario_weftd_hostile
         COMMAND ${WEFT_PYTHON} ${cli_tests}/weftd_hostile.py $<TARGET_FILE:weftd> $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR})
set_tests_properties(scenario_weftd_hostile PROPERTIES TIMEOUT 300 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)

# The installation on the machine of a bench.
add_test(NAME scenario_installed COMMAND ${WEFT_PYTHON} ${cli_tests}/installed.py ${PROJECT_BINARY_DIR})
add_test(NAME scenario_packages COMMAND ${WEFT_PYTHON} ${cli_tests}/packages.py ${PROJECT_BINARY_DIR} ${PROJECT_SOURCE_DIR})
add_test(NAME scenario_ci_check COMMAND ${WEFT_PYTHON} ${cli_tests}/ci_check.py $<TARGET_FILE:weft> ${PROJECT_SOURCE_DIR})
set_tests_properties(scenario_ci_check PROPERTIES TIMEOUT 300 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)
# Both write the unit with their prefix into the build tree.
set_tests_properties(scenario_installed scenario_packages PROPERTIES TIMEOUT 300 SKIP_RETURN_CODE 77 RESOURCE_LOCK weftd_unit
                     ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)

# Other software on the machine: an MPI runtime without headers, a broken Boost and OpenSSL beside another Python first on the PATH.
add_test(NAME scenario_configure_elsewhere
         COMMAND ${WEFT_PYTHON} ${cli_tests}/configure_elsewhere.py ${CMAKE_COMMAND} ${PROJECT_SOURCE_DIR} ${CMAKE_MAKE_PROGRAM})
set_tests_properties(scenario_configure_elsewhere PROPERTIES TIMEOUT 300 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)

# Files of the last version still open.
add_test(NAME scenario_last_version
         COMMAND ${WEFT_PYTHON} ${cli_tests}/last_version.py $<TARGET_FILE:weft> $<TARGET_FILE:weftd> ${PROJECT_SOURCE_DIR})
set_tests_properties(scenario_last_version PROPERTIES TIMEOUT 300 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)

# script/test has three slots for each processor and one more: a test that computes takes three, one that mostly waits takes one. The waiting tests
# run in four lanes, one at a time in each, so that a computing test always has room beside them. Otherwise ctest would fill each free slot with
# another waiting test.
get_property(all_tests DIRECTORY PROPERTY TESTS)
set_tests_properties(${all_tests} PROPERTIES PROCESSORS 3 COST 500)
set_tests_properties(unit_daemon_service unit_daemon_campaign scenario_cli_real_fabrics PROPERTIES COST 600)
function(weft_waits lane)
  foreach(waiting ${ARGN})
    if(TEST ${waiting})
      set_tests_properties(${waiting} PROPERTIES PROCESSORS 1 COST 1000 RESOURCE_LOCK waits_${lane})
    endif()
  endforeach()
endfunction()
weft_waits(1 scenario_python_data scenario_python_notebook scenario_python_vibration scenario_host_signals scenario_rig_tcp scenario_doctor scenario_rig_hosts)
weft_waits(2 scenario_docs_commands scenario_pypi_clients scenario_weftd_notify scenario_box_pages scenario_echo_line scenario_vibro_ports
           scenario_real_port)
weft_waits(3 scenario_bluesky_rig scenario_weftd_motion scenario_device_locks scenario_weftd_samples scenario_weftd_http scenario_netft_client
           scenario_pytest_plugin)
weft_waits(4 scenario_apt_client scenario_modbus_clients scenario_weftd_end scenario_train_mpi scenario_plugins scenario_weftd_tls
           scenario_weftd_access unit_python_client)

# The laboratory's store. Skipped without Debian's PostgreSQL server.
add_test(NAME scenario_lab_store
         COMMAND ${WEFT_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/scenario/lab_store.py $<TARGET_FILE:weft> $<TARGET_FILE:test_daemon_service> ${PROJECT_SOURCE_DIR})
set_tests_properties(scenario_lab_store PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 600 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)

# A campaign over three rigs and the store, with faults. Its leases are short, so it has the processors almost for itself.
add_test(NAME scenario_lab_rigs
         COMMAND ${WEFT_PYTHON} ${cli_tests}/lab_rigs.py $<TARGET_FILE:weft> $<TARGET_FILE:weftd> ${PROJECT_SOURCE_DIR})
set_tests_properties(scenario_lab_rigs PROPERTIES SKIP_RETURN_CODE 77 PROCESSORS 6 COST 900 TIMEOUT 600 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)
