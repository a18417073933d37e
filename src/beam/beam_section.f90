!> The section along the beam in units of the mean section: area A/Abar and second moment I/Ibar.
!>
!> Everything is a function of the distance to the tip (in L), never of 1 - x: where a wedge ends in
!> a point the section is then exact to the last digit.
module beam_section
   use cubic_splines, only: spline_curvature
   use kinds, only: wp
   use section_shapes, only: area_of_shape, fibre_of_shape, inertia_of_shape, is_uniform, mean_of_profile, &
      profile_cubic, &
      profile_linear, profile_stepped, section_settings_t, shape_general
   implicit none (type, external)
   private
   public :: section_t, uniform_section, tapered_section, height_table_section, section_table_section
   public :: shaped_section, outer_fibre
   public :: area, inertia, section_is_uniform, section_is_taper, area_degree, inertia_degree


   !> How the section varies
   integer, parameter :: kind_uniform = 0
   integer, parameter :: kind_taper = 1
   integer, parameter :: kind_height_table = 2
   integer, parameter :: kind_section_table = 3
   integer, parameter :: kind_shape = 4

   type :: section_t
      !> One of the `kind_` constants
      integer :: kind = kind_uniform
      !> s = (h0 - h1)/(2 hbar): 0 uniform, 1 full wedge
      real(wp) :: taper = 0.0_wp
      !> h1/hbar
      real(wp) :: tip_height = 1.0_wp
      !> Distances of the stations to the tip (in L), descending from 1 to 0, for the tables
      real(wp), allocatable :: tip_distance(:)
      !> h/hbar at the stations
      real(wp), allocatable :: height(:)
      !> A/Abar and I/Ibar at the stations
      real(wp), allocatable :: area(:), inertia(:)
      !> A shape: what it is, and how it goes on between stations, one of the constants of section_shapes
      integer :: shape = 0
      integer :: profile = profile_linear
      !> Its dimensions at the stations and, of a spline, their second derivatives, any unit, [stations]
      real(wp), allocatable :: first(:), second(:)
      real(wp), allocatable :: first_curvature(:), second_curvature(:)
      !> Its mean area and second moment of area in that unit
      real(wp) :: mean_area = 1.0_wp
      real(wp) :: mean_inertia = 1.0_wp
      !> Distance of the outer fibre from the axis over hbar: everywhere, or, allocated, at the stations; 0: not known
      real(wp) :: fibre = 0.5_wp
      real(wp), allocatable :: fibres(:)
   end type section_t

contains

   !> A = Abar, I = Ibar everywhere.
   pure function uniform_section() result(section)
      type(section_t) :: section

      section%kind = kind_uniform
   end function uniform_section

   !> Height linear from root to tip.
   pure function tapered_section(height_root, height_tip) result(section)
      !> Heights at clamp and tip, any unit, root > 0, tip >= 0
      real(wp), intent(in) :: height_root
      real(wp), intent(in) :: height_tip
      type(section_t) :: section

      real(wp) :: mean

      if (height_root >= height_tip .and. height_root <= height_tip) return
      mean = 0.5_wp*(height_root + height_tip)
      section%kind = kind_taper
      section%taper = 0.5_wp*(height_root - height_tip)/mean
      section%tip_height = height_tip/mean
   end function tapered_section

   !> Height given at stations, linear between them.
   pure function height_table_section(station, height) result(section)
      !> x/L of the stations, ascending from 0 to 1
      real(wp), intent(in) :: station(:)
      !> Heights there, any unit, [size(station)]
      real(wp), intent(in) :: height(:)
      type(section_t) :: section

      section%kind = kind_height_table
      allocate (section%tip_distance, source=1.0_wp - station)
      allocate (section%height, source=height/table_mean(station, height))
   end function height_table_section

   !> Area and second moment of area given at stations, linear between them.
   pure function section_table_section(station, areas, inertias) result(section)
      !> x/L of the stations, ascending from 0 to 1
      real(wp), intent(in) :: station(:)
      !> Area and second moment of area there, any units, [size(station)]
      real(wp), intent(in) :: areas(:)
      real(wp), intent(in) :: inertias(:)
      type(section_t) :: section

      section%kind = kind_section_table
      allocate (section%tip_distance, source=1.0_wp - station)
      allocate (section%area, source=areas/table_mean(station, areas))
      allocate (section%inertia, source=inertias/table_mean(station, inertias))
   end function section_table_section

   !> Any shape, uniform, linear between stations, in steps, or smooth.
   pure function shaped_section(settings, length) result(section)
      !> Complete
      type(section_settings_t), intent(in) :: settings
      !> L, in the unit of its stations
      real(wp), intent(in) :: length
      type(section_t) :: section

      real(wp) :: mean_height
      integer :: count

      associate (first => mean_of_profile(settings, length, settings%first), &
         second => mean_of_profile(settings, length, settings%second))
         section%mean_area = area_of_shape(settings%shape, first, second)
         section%mean_inertia = inertia_of_shape(settings%shape, first, second)
         mean_height = sqrt(12.0_wp*section%mean_inertia/section%mean_area)
         section%fibre = fibre_of_shape(settings%shape, first, second)/mean_height
      end associate
      section%shape = settings%shape
      section%profile = settings%profile
      if (allocated(settings%outer_fibre)) section%fibre = settings%outer_fibre(1)/mean_height
      if (is_uniform(settings)) return
      section%kind = kind_shape
      count = size(settings%station)
      section%tip_distance = 1.0_wp - settings%station/length
      allocate (section%first(count), source=settings%first)
      allocate (section%second(count), source=settings%second)
      if (allocated(settings%outer_fibre)) allocate (section%fibres(count), source=settings%outer_fibre/mean_height)
      if (settings%profile == profile_stepped) then
         ! the last goes on to the tip
         section%tip_distance = [section%tip_distance, 0.0_wp]
         section%first = [section%first, section%first(count)]
         section%second = [section%second, section%second(count)]
         if (allocated(section%fibres)) section%fibres = [section%fibres, section%fibres(count)]
      else if (settings%profile == profile_cubic) then
         section%first_curvature = spline_curvature(-section%tip_distance, section%first, &
            [.false., .false.])
         section%second_curvature = spline_curvature(-section%tip_distance, section%second, &
            [.false., .false.])
      end if
   end function shaped_section

   !> Distance of the outer fibre from the axis over hbar, c of the stress M c/I; hbar is sqrt(12 Ibar/Abar), of a
   !> rectangle its mean height. 0: not known.
   pure function outer_fibre(section, tip_distance) result(fibre)
      type(section_t), intent(in) :: section
      !> Distance to the tip in L, 0 to 1
      real(wp), intent(in) :: tip_distance
      real(wp) :: fibre

      select case (section%kind)
      case (kind_uniform)
         fibre = section%fibre
      case (kind_section_table)
         fibre = 0.0_wp
      case (kind_shape)
         if (allocated(section%fibres)) then
            fibre = profile_value(section, section%fibres, tip_distance)
         else
            fibre = fibre_of_shape(section%shape, profile_value(section, section%first, tip_distance, &
               section%first_curvature), profile_value(section, section%second, tip_distance, &
               section%second_curvature))*sqrt(section%mean_area/(12.0_wp*section%mean_inertia))
         end if
      case default
         fibre = 0.5_wp*area(section, tip_distance)
      end select
   end function outer_fibre

   !> A dimension of a shape.
   pure function profile_value(section, values, tip_distance, curvature) result(value)
      type(section_t), intent(in) :: section
      !> At the stations
      real(wp), intent(in) :: values(:)
      !> Distance to the tip in L
      real(wp), intent(in) :: tip_distance
      !> Of a spline: second derivatives at the stations
      real(wp), intent(in), optional :: curvature(:)
      real(wp) :: value

      real(wp) :: weight, width
      integer :: low

      low = load_segment_at(section%tip_distance, tip_distance)
      if (section%profile == profile_stepped) then
         value = values(low)
         return
      end if
      width = section%tip_distance(low) - section%tip_distance(low + 1)
      weight = (tip_distance - section%tip_distance(low + 1))/width
      value = values(low + 1) + weight*(values(low) - values(low + 1))
      if (.not. present(curvature)) return
      value = value + ((weight**3 - weight)*curvature(low) &
         + ((1.0_wp - weight)**3 - (1.0_wp - weight))*curvature(low + 1))*width**2/6.0_wp
   end function profile_value

   !> Mean over the length of values that vary linearly between stations.
   pure function table_mean(station, values) result(mean)
      !> x/L, ascending from 0 to 1
      real(wp), intent(in) :: station(:)
      !> Values there
      real(wp), intent(in) :: values(:)
      real(wp) :: mean

      associate (m => size(station))
         mean = sum(0.5_wp*(values(2:m) + values(:m - 1))*(station(2:m) - station(:m - 1))) &
            /(station(m) - station(1))
      end associate
   end function table_mean

   !> Is the section the same all along?
   pure function section_is_uniform(section) result(uniform)
      type(section_t), intent(in) :: section
      logical :: uniform

      uniform = section%kind == kind_uniform
   end function section_is_uniform

   !> Does the height vary linearly over the whole length?
   pure function section_is_taper(section) result(taper)
      type(section_t), intent(in) :: section
      logical :: taper

      taper = section%kind == kind_taper
   end function section_is_taper

   !> A/Abar at a distance from the tip.
   pure function area(section, tip_distance) result(value)
      type(section_t), intent(in) :: section
      !> Distance to the tip in L, 0 to 1
      real(wp), intent(in) :: tip_distance
      real(wp) :: value

      select case (section%kind)
      case (kind_taper)
         value = section%tip_height + 2.0_wp*section%taper*tip_distance
      case (kind_height_table)
         value = interpolate(section%tip_distance, section%height, tip_distance)
      case (kind_section_table)
         value = interpolate(section%tip_distance, section%area, tip_distance)
      case (kind_shape)
         value = area_of_shape(section%shape, profile_value(section, section%first, tip_distance, &
            section%first_curvature), profile_value(section, section%second, tip_distance, &
            section%second_curvature))/section%mean_area
      case default
         value = 1.0_wp
      end select
   end function area

   !> I/Ibar at a distance from the tip.
   pure function inertia(section, tip_distance) result(value)
      type(section_t), intent(in) :: section
      !> Distance to the tip in L, 0 to 1
      real(wp), intent(in) :: tip_distance
      real(wp) :: value

      if (section%kind == kind_section_table) then
         value = interpolate(section%tip_distance, section%inertia, tip_distance)
      else if (section%kind == kind_shape) then
         value = inertia_of_shape(section%shape, profile_value(section, section%first, tip_distance, &
            section%first_curvature), profile_value(section, section%second, tip_distance, &
            section%second_curvature))/section%mean_inertia
      else
         value = area(section, tip_distance)**3
      end if
   end function inertia

   !> Degree of the area as a polynomial between stations.
   pure function area_degree(section) result(degree)
      type(section_t), intent(in) :: section
      integer :: degree

      degree = merge(0, 1, section%kind == kind_uniform)
      if (section%kind == kind_shape) degree = merge(1, 2, section%shape == shape_general)*dimension_degree(section)
   end function area_degree

   !> Degree of the second moment of area as a polynomial between stations.
   pure function inertia_degree(section) result(degree)
      type(section_t), intent(in) :: section
      integer :: degree

      select case (section%kind)
      case (kind_uniform)
         degree = 0
      case (kind_section_table)
         degree = 1
      case (kind_shape)
         degree = merge(1, 4, section%shape == shape_general)*dimension_degree(section)
      case default
         degree = 3
      end select
   end function inertia_degree

   !> Degree of the dimensions of a shape between stations.
   pure function dimension_degree(section) result(degree)
      type(section_t), intent(in) :: section
      integer :: degree

      degree = 1
      if (section%profile == profile_stepped) degree = 0
      if (section%profile == profile_cubic) degree = 3
   end function dimension_degree

   !> Linear interpolation in a table over the distance to the tip.
   pure function interpolate(tip_distances, values, tip_distance) result(value)
      !> Distances of the stations, descending
      real(wp), intent(in) :: tip_distances(:)
      !> Values at the stations
      real(wp), intent(in) :: values(:)
      !> Where
      real(wp), intent(in) :: tip_distance
      real(wp) :: value

      integer :: low
      real(wp) :: weight

      low = load_segment_at(tip_distances, tip_distance)
      associate (high => low + 1)
         weight = (tip_distance - tip_distances(high))/(tip_distances(low) - tip_distances(high))
         value = values(high) + weight*(values(low) - values(high))
      end associate
   end function interpolate

   !> The last station before a distance to the tip.
   pure function load_segment_at(tip_distances, tip_distance) result(low)
      !> Distances of the stations, descending
      real(wp), intent(in) :: tip_distances(:)
      !> Where
      real(wp), intent(in) :: tip_distance
      integer :: low

      integer :: high, middle

      low = 1
      high = size(tip_distances)
      do while (high - low > 1)
         middle = (low + high)/2
         if (tip_distances(middle) > tip_distance) then
            low = middle
         else
            high = middle
         end if
      end do
   end function load_segment_at

end module beam_section
