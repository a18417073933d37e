!> The cross-section along the beam relative to the mean section: area A/Abar and second moment of area I/Ibar. The mean
!> section has the mean height if the section is a taper or a table of heights, the means of A and of I if the section
!> is a table of both, and the mean dimensions if the section is a shape. A station is a position at which the section
!> is given; hbar = sqrt(12 Ibar/Abar) is the mean height.
!>
!> All values are functions of the distance to the tip in L instead of x, because 1 - x would lose digits near the tip,
!> where the section of a wedge vanishes.
module beam_section
   use cubic_splines, only: spline_curvature
   use kinds, only: wp
   use section_shapes, only: area_of_shape, outer_fibre_of_shape, inertia_of_shape, is_uniform, mean_of_profile, &
      mean_of_table, profile_cubic, &
      profile_linear, profile_stepped, section_settings_t, shape_general
   implicit none (type, external)
   private
   public :: section_t, uniform_section, tapered_section, height_table_section, section_table_section
   public :: shaped_section, outer_fibre, fibre_over_inertia, heights_of_elements
   public :: area, inertia, section_is_uniform, section_is_taper, area_degree, inertia_degree

   !> Kinds of variation along the beam
   integer, parameter :: kind_uniform = 0
   integer, parameter :: kind_taper = 1
   integer, parameter :: kind_height_table = 2
   integer, parameter :: kind_shape = 3

   !> A section along the beam. Components that its kind does not use have no meaning.
   type :: section_t
      !> One of the `kind_` constants
      integer :: kind = kind_uniform
      !> Taper s = (h0 - h1)/(2 hbar): 0 uniform, 1 full wedge
      real(wp) :: taper = 0.0_wp
      !> Height at the tip, h1/hbar
      real(wp) :: tip_height = 1.0_wp
      !> Distances of the stations of a table to the tip in L, descending from 1 to 0
      real(wp), allocatable :: tip_distance(:)
      !> Heights h/hbar at the stations
      real(wp), allocatable :: height(:)
      !> Shape: one of the `shape_` constants of `section_shapes`
      integer :: shape = 0
      !> Interpolation of the dimensions between stations: one of the `profile_` constants
      integer :: profile = profile_linear
      !> First dimension of the shape, as `section_shapes` defines it, in any unit, [stations]
      real(wp), allocatable :: first(:)
      !> Second dimension of the shape, in the same unit, [stations]
      real(wp), allocatable :: second(:)
      !> Second derivatives of the first dimension of a cubic spline, [stations]
      real(wp), allocatable :: first_curvature(:)
      !> Second derivatives of the second dimension of a cubic spline, [stations]
      real(wp), allocatable :: second_curvature(:)
      !> Area of the mean dimensions, in the unit of the dimensions
      real(wp) :: mean_area = 1.0_wp
      !> Second moment of area of the mean dimensions, in that unit
      real(wp) :: mean_inertia = 1.0_wp
      !> Distance of the outer fibre of a uniform section from the neutral axis over hbar, 1/2 for a rectangle; 0:
      !> unknown
      real(wp) :: fibre = 0.5_wp
      !> Distances of the outer fibre over hbar at the stations; unallocated: those of a shape follow from its
      !> dimensions
      real(wp), allocatable :: fibres(:)
      !> Second derivatives of these distances of a cubic spline, [stations]
      real(wp), allocatable :: fibre_curvature(:)
   end type section_t

contains

   !> A uniform section with A = Abar, I = Ibar.
   pure type(section_t) function uniform_section() result(section)

      section%kind = kind_uniform
   end function uniform_section

   !> A section of constant width whose height varies linearly from root to tip.
   pure type(section_t) function tapered_section(height_root, height_tip) result(section)
      !> Height at the root, any unit, > 0
      real(wp), intent(in) :: height_root
      !> Height at the tip, in the same unit, >= 0
      real(wp), intent(in) :: height_tip

      real(wp) :: mean

      ! equal heights: a uniform section, the default
      if (height_root >= height_tip .and. height_root <= height_tip) return
      mean = 0.5_wp*(height_root + height_tip)
      section%kind = kind_taper
      section%taper = 0.5_wp*(height_root - height_tip)/mean
      section%tip_height = height_tip/mean
   end function tapered_section

   !> A section of constant width whose height is given at stations and linear between them.
   pure type(section_t) function height_table_section(station, height) result(section)
      !> Positions x/L of the stations, ascending from 0 to 1
      real(wp), intent(in) :: station(:)
      !> Heights at the stations, any unit, [size(station)]
      real(wp), intent(in) :: height(:)

      section%kind = kind_height_table
      allocate (section%tip_distance, source=1.0_wp - station)
      allocate (section%height, source=height/mean_of_table(station, height))
   end function height_table_section

   !> A section whose area and second moment of area are given at stations and linear between them.
   pure type(section_t) function section_table_section(station, areas, inertias) result(section)
      !> Positions x/L of the stations, ascending from 0 to 1
      real(wp), intent(in) :: station(:)
      !> Areas at the stations, any unit, [size(station)]
      real(wp), intent(in) :: areas(:)
      !> Second moments of area at the stations, any unit, [size(station)]
      real(wp), intent(in) :: inertias(:)

      section%kind = kind_shape
      section%shape = shape_general
      allocate (section%tip_distance, source=1.0_wp - station)
      allocate (section%first, source=areas/mean_of_table(station, areas))
      allocate (section%second, source=inertias/mean_of_table(station, inertias))
   end function section_table_section

   !> A section of any shape, whose dimensions are uniform, linear between stations, stepped, or a cubic spline.
   pure type(section_t) function shaped_section(settings, length) result(section)
      !> Settings of the shape, with `first` and `second` at each station
      type(section_settings_t), intent(in) :: settings
      !> Length L in the unit of the stations
      real(wp), intent(in) :: length

      real(wp) :: mean_height
      integer :: count

      associate (first => mean_of_profile(settings, length, settings%first), &
         second => mean_of_profile(settings, length, settings%second))
         section%mean_area = area_of_shape(settings%shape, first, second)
         section%mean_inertia = inertia_of_shape(settings%shape, first, second)
         mean_height = sqrt(12.0_wp*section%mean_inertia/section%mean_area)
         section%fibre = outer_fibre_of_shape(settings%shape, first, second)/mean_height
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
         ! the last dimensions continue to the tip
         section%tip_distance = [section%tip_distance, 0.0_wp]
         section%first = [section%first, section%first(count)]
         section%second = [section%second, section%second(count)]
         if (allocated(section%fibres)) section%fibres = [section%fibres, section%fibres(count)]
      else if (settings%profile == profile_cubic) then
         ! splines need ascending coordinates; their curvature is zero at both ends
         section%first_curvature = spline_curvature(-section%tip_distance, section%first, &
            [.false., .false.])
         section%second_curvature = spline_curvature(-section%tip_distance, section%second, &
            [.false., .false.])
         if (allocated(section%fibres)) section%fibre_curvature = spline_curvature(-section%tip_distance, &
            section%fibres, [.false., .false.])
      end if
   end function shaped_section

   !> c/I, with which a moment M causes the stress M c/I; c in hbar, I in Ibar. At a step of the section the result is
   !> the greater value of both sides. It is 0 if c is unknown, or if the section ends in a point, where the stress is 0
   !> if nothing acts on the point.
   pure real(wp) function fibre_over_inertia(section, tip_distance) result(ratio)
      type(section_t), intent(in) :: section
      !> Distance to the tip in L, 0 to 1
      real(wp), intent(in) :: tip_distance

      ! a position this close to a step, in L, is at the step
      real(wp), parameter :: rounding = 1.0e-12_wp
      integer :: side

      ratio = 0.0_wp
      ! both sides are equal unless the profile is stepped
      do side = -1, 1, 2
         associate (at => tip_distance + merge(real(side, wp)*rounding, 0.0_wp, section%kind == kind_shape .and. &
            section%profile == profile_stepped))
            if (inertia(section, at) > 0.0_wp) ratio = max(ratio, outer_fibre(section, at)/inertia(section, at))
         end associate
      end do
   end function fibre_over_inertia

   !> Distance c of the outer fibre from the neutral axis over hbar, for the stress M c/I; 0: unknown. The length hbar
   !> is sqrt(12 Ibar/Abar), for a rectangle the mean height.
   pure real(wp) function outer_fibre(section, tip_distance) result(fibre)
      type(section_t), intent(in) :: section
      !> Distance to the tip in L, 0 to 1
      real(wp), intent(in) :: tip_distance

      select case (section%kind)
      case (kind_uniform)
         fibre = section%fibre
      case (kind_shape)
         ! the second derivatives are unallocated, and so absent, unless the profile is cubic
         if (allocated(section%fibres)) then
            fibre = profile_value(section, section%fibres, tip_distance, section%fibre_curvature)
         else
            fibre = outer_fibre_of_shape(section%shape, profile_value(section, section%first, tip_distance, &
               section%first_curvature), profile_value(section, section%second, tip_distance, &
               section%second_curvature))*sqrt(section%mean_area/(12.0_wp*section%mean_inertia))
         end if
      case default
         ! a rectangle of constant width: A/Abar = h/hbar
         fibre = 0.5_wp*area(section, tip_distance)
      end select
   end function outer_fibre

   !> Heights at both ends of each element over hbar: twice the distance of the outer fibre, or sqrt(12 I/A) if the
   !> section is given by area and second moment of area.
   pure function heights_of_elements(section, node_position) result(height)
      type(section_t), intent(in) :: section
      !> Positions x/L of the nodes, ascending from 0 to 1
      real(wp), intent(in) :: node_position(:)
      !> [end towards the root and end towards the tip, elements]
      real(wp) :: height(2, size(node_position) - 1)

      ! the section at an end is that at this distance within the element, in L: a step may be at the node
      real(wp), parameter :: rounding = 1.0e-12_wp
      real(wp) :: tip_distance(2)
      integer :: end, i

      height = 0.0_wp
      do i = 1, size(height, 2)
         tip_distance = 1.0_wp - node_position(i:i + 1) + [-rounding, rounding]
         do end = 1, 2
            if (section%shape == shape_general) then
               if (area(section, tip_distance(end)) > 0.0_wp) height(end, i) = &
                  sqrt(inertia(section, tip_distance(end))/area(section, tip_distance(end)))
            else
               height(end, i) = 2.0_wp*outer_fibre(section, tip_distance(end))
            end if
         end do
      end do
   end function heights_of_elements

   !> A dimension of a shape at a distance from the tip.
   pure real(wp) function profile_value(section, values, tip_distance, curvature) result(value)
      type(section_t), intent(in) :: section
      !> Values at the stations
      real(wp), intent(in) :: values(:)
      !> Distance to the tip in L
      real(wp), intent(in) :: tip_distance
      !> Second derivatives at the stations, for a cubic spline
      real(wp), intent(in), optional :: curvature(:)

      real(wp) :: weight, width
      integer :: low

      low = station_before(section%tip_distance, tip_distance)
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

   !> Whether the section is uniform.
   pure logical function section_is_uniform(section) result(uniform)
      type(section_t), intent(in) :: section

      uniform = section%kind == kind_uniform
   end function section_is_uniform

   !> Whether the height varies linearly over the whole length.
   pure logical function section_is_taper(section) result(taper)
      type(section_t), intent(in) :: section

      taper = section%kind == kind_taper
   end function section_is_taper

   !> A/Abar at a distance from the tip.
   pure real(wp) function area(section, tip_distance) result(value)
      type(section_t), intent(in) :: section
      !> Distance to the tip in L, 0 to 1
      real(wp), intent(in) :: tip_distance

      select case (section%kind)
      case (kind_taper)
         value = section%tip_height + 2.0_wp*section%taper*tip_distance
      case (kind_height_table)
         value = profile_value(section, section%height, tip_distance)
      case (kind_shape)
         value = area_of_shape(section%shape, profile_value(section, section%first, tip_distance, &
            section%first_curvature), profile_value(section, section%second, tip_distance, &
            section%second_curvature))/section%mean_area
      case default
         value = 1.0_wp
      end select
   end function area

   !> I/Ibar at a distance from the tip.
   pure real(wp) function inertia(section, tip_distance) result(value)
      type(section_t), intent(in) :: section
      !> Distance to the tip in L, 0 to 1
      real(wp), intent(in) :: tip_distance

      if (section%kind == kind_shape) then
         value = inertia_of_shape(section%shape, profile_value(section, section%first, tip_distance, &
            section%first_curvature), profile_value(section, section%second, tip_distance, &
            section%second_curvature))/section%mean_inertia
      else
         value = area(section, tip_distance)**3
      end if
   end function inertia

   !> Degree of the area as a polynomial between stations.
   pure integer function area_degree(section) result(degree)
      type(section_t), intent(in) :: section

      degree = merge(0, 1, section%kind == kind_uniform)
      if (section%kind == kind_shape) degree = merge(1, 2, section%shape == shape_general)*dimension_degree(section)
   end function area_degree

   !> Degree of the second moment of area as a polynomial between stations.
   pure integer function inertia_degree(section) result(degree)
      type(section_t), intent(in) :: section

      select case (section%kind)
      case (kind_uniform)
         degree = 0
      case (kind_shape)
         degree = merge(1, 4, section%shape == shape_general)*dimension_degree(section)
      case default
         degree = 3
      end select
   end function inertia_degree

   !> Degree of the dimensions of a shape between stations.
   pure integer function dimension_degree(section) result(degree)
      type(section_t), intent(in) :: section

      degree = 1
      if (section%profile == profile_stepped) degree = 0
      if (section%profile == profile_cubic) degree = 3
   end function dimension_degree

   !> Index of the station at the root end of the interval between stations that contains a position. A position at a
   !> station belongs to the interval on the side of the root, a position beyond the ends to the first or last interval.
   pure integer function station_before(tip_distances, tip_distance) result(low)
      !> Distances of the stations to the tip, descending
      real(wp), intent(in) :: tip_distances(:)
      !> Distance of the position to the tip
      real(wp), intent(in) :: tip_distance

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
   end function station_before

end module beam_section
