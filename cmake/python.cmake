# SPDX-License-Identifier: MIT
# Whether the Python module is built. DARB_PYTHON is OFF, ON, or AUTO, which builds it where everything it needs is
# found; DARB_WITH_PYTHON is the answer. It is found out before the libraries, because they are compiled differently for
# the module.
set(DARB_WITH_PYTHON OFF)
# A wheel's Pythons need not be on this machine: their headers do.
set(DARB_PYTHON_HEADERS "" CACHE STRING "Further Pythons to build the module for: folders pythonX.Y with their headers (tools/wheel.sh)")
set(DARB_PYBIND11_HEADERS "" CACHE PATH "The folder above the headers of pybind11, for these")
if(DARB_PYTHON_HEADERS)
  set(DARB_WITH_PYTHON ON)
endif()
if(DARB_PYTHON)
  # Python must be that of the distribution, as its numpy is.
  if(NOT Python3_EXECUTABLE AND EXISTS /usr/bin/python3)
    set(Python3_EXECUTABLE /usr/bin/python3 CACHE FILEPATH "The Python that the module is for")
  endif()
  set(Python3_FIND_VIRTUALENV STANDARD)
  find_package(Python3 COMPONENTS Interpreter Development.Module QUIET)
  find_package(pybind11 CONFIG QUIET)
  if(Python3_FOUND AND pybind11_FOUND)
    set(DARB_WITH_PYTHON ON)
    set(DARB_PYTHON_EXECUTABLE ${Python3_EXECUTABLE})
  elseif(DARB_PYTHON STREQUAL "AUTO")
    message(STATUS "No Python module: python3-dev or pybind11-dev is missing (tools/setup.sh installs them)")
  else()
    message(FATAL_ERROR "DARB_PYTHON needs python3-dev and pybind11-dev: tools/setup.sh installs them")
  endif()
endif()
