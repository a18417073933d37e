!> Shapes of cross-sections: area, second moment of area and outer fibre from the two dimensions that define each shape,
!> and the variation of the dimensions along the beam (profile).
module section_shapes
   use cubic_splines, only: spline_curvature
   use kinds, only: pi, wp
   use run_settings, only: name_length
   implicit none (type, external)
   private
   public :: section_settings_t, area_of_shape, inertia_of_shape, outer_fibre_of_shape, is_uniform, mean_of_profile, &
      mean_of_table
   public :: shape_rectangle, shape_round, shape_tube, shape_general, shape_names
   public :: profile_linear, profile_stepped, profile_cubic, profile_names

   !> Rectangle; its first dimension is the width, its second the height
   integer, parameter :: shape_rectangle = 1
   !> Solid circle; both its first and its second dimension are the diameter
   integer, parameter :: shape_round = 2
   !> Tube; its first dimension is the outer diameter, its second the wall thickness
   integer, parameter :: shape_tube = 3
   !> General section; its first dimension is the area, its second the second moment of area
   integer, parameter :: shape_general = 4

   !> Dimensions are linear between stations.
   integer, parameter :: profile_linear = 1
   !> Dimensions are constant from each station to the next.
   integer, parameter :: profile_stepped = 2
   !> Dimensions are natural cubic splines through the stations (curvature 0 at the ends of the beam).
   integer, parameter :: profile_cubic = 3

   !> Names of the `shape_` constants in scene files
   character(*), parameter :: shape_names(4) = [character(name_length) :: 'rectangle', 'round', 'tube', 'general']
   !> Names of the `profile_` constants in scene files
   character(*), parameter :: profile_names(3) = [character(name_length) :: 'linear', 'stepped', 'cubic']

   !> Settings of &section, in the user's units.
   type :: section_settings_t
      !> One of the `shape_` constants
      integer :: shape = shape_rectangle
      !> One of the `profile_` constants
      integer :: profile = profile_linear
      !> Stations from 0 to L, ascending; for a stepped profile, the beginnings of the steps. Unallocated: a uniform
      !> section
      real(wp), allocatable :: station(:)
      !> Dimensions as given in the file, one value for each station, or one value for the whole beam
      real(wp), allocatable :: width(:), height(:), diameter(:), outer_diameter(:), wall(:), inner_diameter(:)
      real(wp), allocatable :: area(:), inertia(:)
      !> First dimension of the shape, one value for each station, or one value for the whole beam
      real(wp), allocatable :: first(:)
      !> Second dimension of the shape, one value for each station, or one value for the whole beam
      real(wp), allocatable :: second(:)
      !> Distance of the outer fibre from the neutral axis, for `shape_general`; unallocated: not known
      real(wp), allocatable :: outer_fibre(:)
   end type section_settings_t

contains

   !> Area of a section.
   elemental real(wp) function area_of_shape(shape, first, second) result(area)
      !> One of the `shape_` constants
      integer, intent(in) :: shape
      !> First dimension of the shape
      real(wp), intent(in) :: first
      !> Second dimension of the shape
      real(wp), intent(in) :: second

      select case (shape)
      case (shape_rectangle)
         area = first*second
      case (shape_round)
         area = 0.25_wp*pi*first**2
      case (shape_tube)
         area = pi*second*(first - second)
      case default
         area = first
      end select
   end function area_of_shape

   !> Second moment of area of a section.
   elemental real(wp) function inertia_of_shape(shape, first, second) result(inertia)
      !> One of the `shape_` constants
      integer, intent(in) :: shape
      !> First dimension of the shape
      real(wp), intent(in) :: first
      !> Second dimension of the shape
      real(wp), intent(in) :: second

      select case (shape)
      case (shape_rectangle)
         inertia = first*second**3/12.0_wp
      case (shape_round)
         inertia = pi*first**4/64.0_wp
      case (shape_tube)
         ! pi/64 (outer^4 - inner^4) without the difference of nearly equal powers
         associate (inner => first - 2.0_wp*second)
            inertia = pi*second*(first - second)*(first**2 + inner**2)/16.0_wp
         end associate
      case default
         inertia = second
      end select
   end function inertia_of_shape

   !> Distance of the outer fibre from the neutral axis; 0: not known.
   elemental real(wp) function outer_fibre_of_shape(shape, first, second) result(fibre)
      !> One of the `shape_` constants
      integer, intent(in) :: shape
      !> First dimension of the shape
      real(wp), intent(in) :: first
      !> Second dimension of the shape
      real(wp), intent(in) :: second

      fibre = 0.5_wp*first
      if (shape == shape_rectangle) fibre = 0.5_wp*second
      if (shape == shape_general) fibre = 0.0_wp
   end function outer_fibre_of_shape

   !> Whether the section is constant along the beam, that is, each dimension has a single value.
   pure logical function is_uniform(section) result(uniform)
      type(section_settings_t), intent(in) :: section

      uniform = size(section%first) == 1 .and. size(section%second) == 1
   end function is_uniform

   !> Mean of a dimension over the length of the beam, exact for each profile.
   pure real(wp) function mean_of_profile(section, length, values) result(mean)
      type(section_settings_t), intent(in) :: section
      real(wp), intent(in) :: length
      !> Values of the dimension at the stations, or one value
      real(wp), intent(in) :: values(:)

      ! distances between neighbouring stations
      real(wp), allocatable :: spacing(:)
      integer :: stations

      stations = size(values)
      mean = values(1)
      if (stations == 1) return
      if (section%profile == profile_stepped) then
         mean = sum(values*([section%station(2:), length] - section%station))/length
         return
      end if
      mean = mean_of_table(section%station, values)
      if (section%profile == profile_linear) return
      spacing = section%station(2:) - section%station(:stations - 1)
      ! the integral of a cubic of end curvatures a and b over a length h is that of its chord, less (a + b) h^3/24
      associate (curvature => spline_curvature(section%station, values, [.false., .false.]))
         mean = mean - sum((curvature(2:) + curvature(:stations - 1))*spacing**3)/(24.0_wp*length)
      end associate
   end function mean_of_profile

   !> Mean over the length of a function that is linear between stations.
   pure real(wp) function mean_of_table(station, values) result(mean)
      !> Positions of the stations, ascending
      real(wp), intent(in) :: station(:)
      !> Values at the stations
      real(wp), intent(in) :: values(:)

      associate (n => size(station))
         mean = sum(0.5_wp*(values(2:) + values(:n - 1))*(station(2:) - station(:n - 1)))/(station(n) - station(1))
      end associate
   end function mean_of_table

end module section_shapes
