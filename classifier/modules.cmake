# The classifier's modules, lowest first (see weft_module() in the top CMakeLists.txt).
weft_module(classifier/base USES protocols/base SYSTEM Eigen3::Eigen Threads::Threads)
weft_module(classifier/features USES classifier/base)
weft_module(classifier/selection USES classifier/base)
weft_module(classifier/learn USES classifier/base classifier/selection SYSTEM ${LIBSVM})
weft_module(classifier/fabric USES classifier/features classifier/selection classifier/learn)
weft_module(classifier/learners USES classifier/fabric SYSTEM nlohmann_json::nlohmann_json)
weft_module(classifier/vote USES classifier/learners)
weft_module(classifier/evaluate USES classifier/vote)
weft_module(classifier/model USES classifier/vote)
weft_module(classifier/live USES classifier/model)
weft_module(classifier/design USES classifier/evaluate)
weft_module(classifier/imprint USES classifier/model)
weft_module(classifier/vibro USES classifier/evaluate classifier/model)

set(WEFT_CLASSIFIER_MODULES base features selection learn fabric learners vote evaluate model live design imprint vibro)
add_library(weft_classifier INTERFACE)  # all of it
foreach(module ${WEFT_CLASSIFIER_MODULES})
  target_link_libraries(weft_classifier INTERFACE weft_classifier_${module})
  target_compile_options(weft_classifier_${module} PRIVATE -Wno-psabi)  # the ABI of lanes is irrelevant, because no call passes them
endforeach()

# Without errno the compiler can vectorise square roots.
set_source_files_properties(classifier/features/spectrum.cpp classifier/features/taxel_block.cpp classifier/imprint/step_edges.cpp
                            classifier/vibro/short_time.cpp classifier/learners/network.cpp classifier/vibro/level_features.cpp
                            classifier/vibro/real_transform.cpp PROPERTIES COMPILE_OPTIONS -fno-math-errno)
if(WEFT_XGBOOST)
  # Loaded on first use by its run-time name, which is the target of the symbolic link used for linking.
  set(xgboost_library "${XGBOOST_LIBRARY}")
  if(IS_SYMLINK "${XGBOOST_LIBRARY}")
    file(READ_SYMLINK "${XGBOOST_LIBRARY}" xgboost_library)
  endif()
  set_property(SOURCE classifier/learners/boosted.cpp APPEND
               PROPERTY COMPILE_DEFINITIONS "WEFT_XGBOOST_LIBRARY=\"${xgboost_library}\"" "WEFT_XGBOOST_BUILT_WITH=\"${XGBOOST_LIBRARY}\"")
  target_link_libraries(weft_classifier_learners PRIVATE ${CMAKE_DL_LIBS})
endif()

# Kernels are compiled one by one (docs/adr/0009); unity builds join only files that read, write or choose.
file(GLOB kernels CONFIGURE_DEPENDS classifier/base/*.cpp classifier/features/*.cpp classifier/selection/*.cpp classifier/learn/*.cpp
     classifier/fabric/*.cpp classifier/learners/*.cpp classifier/vote/*.cpp)
list(FILTER kernels EXCLUDE REGEX
     "classifier/(base/(line_io|interval)|fabric/(model_text|options)|vote/(postprocessing|calibration|novelty))")
set_source_files_properties(${kernels} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
