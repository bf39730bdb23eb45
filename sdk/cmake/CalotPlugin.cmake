# calot_add_plugin(NAME SOURCES... [LIBRARIES...] [ASSETS...] [OUTPUT_DIRECTORY folder])
#
# Builds one plugin: a shared library with exactly two exported symbols, and its manifest beside it, in a
# folder of its own below lib/calot/plugins, or below OUTPUT_DIRECTORY (plugins that are not shipped). The manifest
# comes from plugin.toml.in in the current folder; @CALOT_LIBRARY@, @CALOT_ABI_MAJOR@, @CALOT_ABI_MINOR@, @CALOT_ABI_FINGERPRINT@, @CALOT_PLATFORM@ and
# @CALOT_ASSETS@ (one [[asset]] with path and SHA-256 for each file of ASSETS) are filled in.
get_filename_component(CALOT_SDK_DIR "${CMAKE_CURRENT_LIST_DIR}/.." ABSOLUTE)

# Everything that a user needs: the program and every plugin, without tests.
if(NOT TARGET calot_runtime)
  add_custom_target(calot_runtime)
endif()
set(CALOT_PLUGIN_VERSION_SCRIPT "${CMAKE_CURRENT_LIST_DIR}/plugin.map")

function(calot_read_abi)
  file(READ "${CALOT_SDK_DIR}/include/calot/abi/common.h" header)
  foreach(name MAJOR MINOR FINGERPRINT)
    # Without the suffix ull, which is C's.
    string(REGEX MATCH "#define CALOT_ABI_${name} ([0-9][0-9A-Fa-fx]*)" _ "${header}")
    set(CALOT_ABI_${name} "${CMAKE_MATCH_1}" PARENT_SCOPE)
  endforeach()
endfunction()

function(calot_add_plugin NAME)
  cmake_parse_arguments(P "" "OUTPUT_DIRECTORY" "SOURCES;LIBRARIES;ASSETS" ${ARGN})
  if(NOT P_OUTPUT_DIRECTORY)
    set(P_OUTPUT_DIRECTORY "${CALOT_PLUGIN_OUTPUT_DIRECTORY}")
    set(is_shipped ON)
  endif()
  set(folder "${P_OUTPUT_DIRECTORY}/${NAME}")
  add_library(${NAME} MODULE ${P_SOURCES})
  target_link_libraries(${NAME} PRIVATE calot::sdk ${P_LIBRARIES})
  set_target_properties(${NAME} PROPERTIES PREFIX "" LIBRARY_OUTPUT_DIRECTORY "${folder}"
    C_VISIBILITY_PRESET hidden CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)
  target_compile_options(${NAME} PRIVATE -ffp-contract=off $<$<CXX_COMPILER_ID:GNU>:-fno-gnu-unique>)
  target_link_options(${NAME} PRIVATE "LINKER:--version-script=${CALOT_PLUGIN_VERSION_SCRIPT}"
    "LINKER:-Bsymbolic" "LINKER:--exclude-libs,ALL")
  if(NOT CALOT_SANITIZE)
    target_link_options(${NAME} PRIVATE "LINKER:--no-undefined")
  endif()
  set_property(TARGET ${NAME} APPEND PROPERTY LINK_DEPENDS "${CALOT_PLUGIN_VERSION_SCRIPT}")

  if(is_shipped)
    add_dependencies(calot_runtime ${NAME})
  endif()

  calot_read_abi()
  set(CALOT_LIBRARY "${NAME}.so")
  set(CALOT_PLATFORM "linux-${CMAKE_SYSTEM_PROCESSOR}")
  set(CALOT_ASSETS "")
  foreach(asset IN LISTS P_ASSETS)
    get_filename_component(absolute "${asset}" ABSOLUTE)
    file(SHA256 "${absolute}" hash)
    string(APPEND CALOT_ASSETS "[[asset]]\npath = \"${asset}\"\nsha256 = \"${hash}\"\n\n")
    configure_file("${absolute}" "${folder}/${asset}" COPYONLY)
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${absolute}")
  endforeach()
  configure_file("${CMAKE_CURRENT_SOURCE_DIR}/plugin.toml.in" "${folder}/plugin.toml" @ONLY)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${CALOT_SDK_DIR}/include/calot/abi/common.h")
endfunction()
