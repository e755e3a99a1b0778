# The package restage of Python: build/<preset>/python/restage. PYTHONPATH=build/<preset>/python finds it.
# Debian's own Python has Debian's NumPy, also where another one comes first in the path.
if(NOT DEFINED Python3_EXECUTABLE AND EXISTS /usr/bin/python3)
  set(Python3_EXECUTABLE /usr/bin/python3)
endif()
find_package(Python3 REQUIRED COMPONENTS Interpreter Development.Module)
find_package(pybind11 2.10 CONFIG REQUIRED)
message(STATUS "Python: ${Python3_VERSION} (${Python3_EXECUTABLE}), pybind11 ${pybind11_VERSION}")

file(GLOB python_sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/python/*.cpp)
Python3_add_library(restage_python MODULE WITH_SOABI ${python_sources})
set(python_folder ${PROJECT_BINARY_DIR}/python/restage)
set_target_properties(restage_python PROPERTIES OUTPUT_NAME _core CXX_VISIBILITY_PRESET hidden
  LIBRARY_OUTPUT_DIRECTORY ${python_folder})
target_link_libraries(restage_python PRIVATE restage_experiments restage_gradcheck pybind11::headers restage_options)
target_link_options(restage_python PRIVATE LINKER:--exclude-libs,ALL)
restage_glue(restage_python)
restage_precompile(restage_python <pybind11/pybind11.h> <pybind11/numpy.h> <pybind11/stl.h>)
restage_join_files(restage_python 4)
restage_library_first(restage_python)

# The package around it.
file(GLOB python_files CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/python/restage/*)
list(FILTER python_files INCLUDE REGEX "\\.(py|pyi|typed)$")
set(python_copies "")
foreach(file IN LISTS python_files)
  get_filename_component(name ${file} NAME)
  add_custom_command(OUTPUT ${python_folder}/${name} DEPENDS ${file} VERBATIM
    COMMAND ${CMAKE_COMMAND} -E copy ${file} ${python_folder}/${name})
  list(APPEND python_copies ${python_folder}/${name})
endforeach()
add_custom_target(restage_python_files ALL DEPENDS ${python_copies})
add_dependencies(restage_python restage_python_files)

# Where Debian's Python looks below the prefix.
if(CMAKE_INSTALL_PREFIX STREQUAL /usr)
  set(python_place lib/python3/dist-packages)
else()
  set(python_place lib/python${Python3_VERSION_MAJOR}.${Python3_VERSION_MINOR}/dist-packages)
endif()
set(RESTAGE_PYTHON_DIR ${python_place} CACHE STRING "where the package for Python is installed, below the prefix")
install(TARGETS restage_python LIBRARY DESTINATION ${RESTAGE_PYTHON_DIR}/restage)
install(FILES ${python_files} DESTINATION ${RESTAGE_PYTHON_DIR}/restage)
