# find_package(nearmiss) gives the targets nearmiss::nearmiss (shared) and nearmiss::static.
get_filename_component(nearmiss_prefix "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)

function(nearmiss_add name kind file)
  if(NOT TARGET ${name} AND EXISTS "${nearmiss_prefix}/lib/${file}")
    add_library(${name} ${kind} IMPORTED)
    set_target_properties(${name} PROPERTIES
      IMPORTED_LOCATION "${nearmiss_prefix}/lib/${file}"
      IMPORTED_NO_SONAME TRUE
      INTERFACE_INCLUDE_DIRECTORIES "${nearmiss_prefix}/include")
  endif()
endfunction()

set(nearmiss_shared "${CMAKE_SHARED_LIBRARY_PREFIX}nearmiss_c${CMAKE_SHARED_LIBRARY_SUFFIX}")
set(nearmiss_static "${CMAKE_STATIC_LIBRARY_PREFIX}nearmiss_c${CMAKE_STATIC_LIBRARY_SUFFIX}")
nearmiss_add(nearmiss::nearmiss SHARED "${nearmiss_shared}")
nearmiss_add(nearmiss::static STATIC "${nearmiss_static}")
if(TARGET nearmiss::static AND UNIX)
  find_package(Threads REQUIRED)
  set_property(TARGET nearmiss::static APPEND PROPERTY
    INTERFACE_LINK_LIBRARIES Threads::Threads m ${CMAKE_DL_LIBS})
endif()

if(NOT TARGET nearmiss::nearmiss)
  set(nearmiss_FOUND FALSE)
  set(nearmiss_NOT_FOUND_MESSAGE "expected ${nearmiss_prefix}/lib/${nearmiss_shared}, got no such file")
endif()
