!> The section along the beam in units of the mean section: area A/Abar and second moment I/Ibar.
!>
!> Everything is a function of the distance to the tip (in L), never of 1 - x: where a wedge ends in
!> a point the section is then exact to the last digit.
module beam_section
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: section_t, uniform_section, tapered_section, height_table_section, section_table_section
   public :: area, inertia, section_is_uniform, section_is_taper, area_degree, inertia_degree


   !> How the section varies
   integer, parameter :: kind_uniform = 0
   integer, parameter :: kind_taper = 1
   integer, parameter :: kind_height_table = 2
   integer, parameter :: kind_section_table = 3

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
      else
         value = area(section, tip_distance)**3
      end if
   end function inertia

   !> Degree of the area as a polynomial between stations.
   pure function area_degree(section) result(degree)
      type(section_t), intent(in) :: section
      integer :: degree

      degree = merge(0, 1, section%kind == kind_uniform)
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
      case default
         degree = 3
      end select
   end function inertia_degree

   !> Linear interpolation in a table over the distance to the tip.
   pure function interpolate(tip_distances, values, tip_distance) result(value)
      !> Distances of the stations, descending
      real(wp), intent(in) :: tip_distances(:)
      !> Values at the stations
      real(wp), intent(in) :: values(:)
      !> Where
      real(wp), intent(in) :: tip_distance
      real(wp) :: value

      integer :: low, high, middle
      real(wp) :: weight

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
      weight = (tip_distance - tip_distances(high))/(tip_distances(low) - tip_distances(high))
      value = values(high) + weight*(values(low) - values(high))
   end function interpolate

end module beam_section
