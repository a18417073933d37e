!> The surfaces that a beam can meet: one of a stop below or above it, two of a stop on both sides.
!>
!> With the sign s = 1 below and -1 above all of them are alike: the gap of a surface at height d is s (y - d), and its
!> force acts on the beam along s.
module stop_surfaces
   use kinds, only: wp
   use load_settings, only: start_pull
   use run_settings, only: law_restitution, law_spring_damper, run_settings_t, side_above, side_below, side_both, &
      stop_settings_t
   implicit none (type, external)
   private
   public :: surface_t, surfaces_of, stops_of, has_one_contact, acting, touch_tolerance, is_beyond

   type :: surface_t
      !> Which &stop of the scene it belongs to, and which surface of all in the scene's order, below before above
      integer :: stop = 1
      integer :: number = 1
      !> s
      real(wp) :: sign = 1.0_wp
      !> s d in units of displacement: the same as the `preload` of its stop
      real(wp) :: height = 0.0_wp
      !> The beam is released from it
      logical :: is_pulled = .false.
      !> Position, law and what that has
      type(stop_settings_t) :: settings
   end type surface_t

   !> More than rounding, less than anything meant, in the unit of displacement.
   real(wp), parameter :: most_beyond = 1.0e-9_wp

contains

   !> A start that lies beyond a surface by this at most touches it, and is moved onto it; one that lies further beyond
   !> is refused.
   elemental function touch_tolerance(surface) result(tolerance)
      type(surface_t), intent(in) :: surface
      real(wp) :: tolerance

      tolerance = most_beyond*max(1.0_wp, abs(surface%height))
   end function touch_tolerance

   !> Does a start with this gap lie beyond the surface, not on it?
   elemental function is_beyond(surface, gap) result(answer)
      type(surface_t), intent(in) :: surface
      real(wp), intent(in) :: gap
      logical :: answer

      answer = gap < -touch_tolerance(surface)
   end function is_beyond

   !> Is a run about one contact and nothing else: a beam on no supports that one rigid stop or one of three elements
   !> below it releases, damped in proportion to its stiffness and left alone, with neither stresses nor statistics? Its
   !> histories are those of the contact, so its file has none of each contact, its modes can be chosen by comparing
   !> runs, and a node without mass can come to the stop.
   pure function has_one_contact(settings, supports) result(answer)
      type(run_settings_t), intent(in) :: settings
      !> How many the beam has along it
      integer, intent(in) :: supports
      logical :: answer

      answer = supports == 0 .and. settings%has_stop .and. .not. allocated(settings%more_stops) .and. &
         settings%stop%side == side_below .and. settings%stop%law /= law_spring_damper
      answer = answer .and. settings%start%kind == start_pull .and. .not. (allocated(settings%forces) .or. &
         allocated(settings%bases) .or. allocated(settings%mode_ratios) .or. settings%zeta_mass > 0.0_wp .or. &
         allocated(settings%stress) .or. allocated(settings%statistics))
   end function has_one_contact

   !> All stops of a run in the scene's order.
   pure function stops_of(settings) result(stops)
      type(run_settings_t), intent(in) :: settings
      type(stop_settings_t), allocatable :: stops(:)

      integer :: further

      if (.not. settings%has_stop) then
         allocate (stops(0))
         return
      end if
      further = 0
      if (allocated(settings%more_stops)) further = size(settings%more_stops)
      allocate (stops(1 + further))
      stops(1) = settings%stop
      if (further > 0) stops(2:) = settings%more_stops
   end function stops_of

   !> All surfaces, in an order that does not depend on the scene's: along the beam, below before above, the highest
   !> first.
   pure function surfaces_of(settings) result(surfaces)
      type(run_settings_t), intent(in) :: settings
      type(surface_t), allocatable :: surfaces(:)

      type(stop_settings_t), allocatable :: stops(:)
      type(surface_t) :: surface
      integer :: i, place, total

      allocate (stops, source=stops_of(settings))
      allocate (surfaces(2*size(stops)))
      total = 0
      do i = 1, size(stops)
         surface = surface_t(stop=i, height=stops(i)%preload, settings=stops(i))
         if (stops(i)%side /= side_above) then
            surface%sign = 1.0_wp
            surface%is_pulled = i == settings%pulled
            total = total + 1
            surface%number = total
            surfaces(total) = surface
         end if
         if (stops(i)%side /= side_below) then
            surface%sign = -1.0_wp
            surface%is_pulled = i == settings%pulled .and. stops(i)%side /= side_both
            total = total + 1
            surface%number = total
            surfaces(total) = surface
         end if
      end do
      do i = 2, total
         surface = surfaces(i)
         place = i
         do while (place > 1)
            if (.not. stands_before(surface, surfaces(place - 1))) exit
            surfaces(place) = surfaces(place - 1)
            place = place - 1
         end do
         surfaces(place) = surface
      end do
      surfaces = surfaces(:total)
   end function surfaces_of

   !> Which of them act? Of rigid ones at one point and on one side the highest does alone, of equal ones the one with
   !> the greatest restitution.
   pure function acting(surfaces, dofs) result(acts)
      type(surface_t), intent(in) :: surfaces(:)
      !> Degree of freedom of each
      integer, intent(in) :: dofs(:)
      logical :: acts(size(surfaces))

      real(wp) :: difference
      integer :: i, k

      acts = .true.
      do k = 1, size(surfaces)
         do i = 1, size(surfaces)
            if (i == k .or. dofs(i) /= dofs(k) .or. surfaces(i)%sign*surfaces(k)%sign < 0.0_wp) cycle
            if (any([surfaces(i)%settings%law, surfaces(k)%settings%law] /= law_restitution)) cycle
            difference = surfaces(i)%height - surfaces(k)%height
            if (.not. abs(difference) > 0.0_wp) then
               difference = surfaces(i)%settings%restitution - surfaces(k)%settings%restitution
            end if
            if (difference > 0.0_wp .or. (.not. abs(difference) > 0.0_wp .and. i < k)) acts(k) = .false.
         end do
      end do
   end function acting

   !> Does one surface stand before another? Those that are alike in all keep the scene's order.
   elemental function stands_before(one, other) result(answer)
      type(surface_t), intent(in) :: one
      type(surface_t), intent(in) :: other
      logical :: answer

      real(wp) :: a(9), b(9)
      integer :: first

      a = keys(one)
      b = keys(other)
      first = findloc(abs(a - b) > 0.0_wp, .true., dim=1)
      answer = .false.
      if (first > 0) answer = a(first) < b(first)
   end function stands_before

   !> What the order goes by, the first first.
   pure function keys(surface) result(values)
      type(surface_t), intent(in) :: surface
      real(wp) :: values(9)

      associate (settings => surface%settings)
         values = [settings%position, -surface%sign, -surface%height, real(settings%law, wp), &
            real(settings%impulse, wp), -settings%restitution, settings%stiffness_ratio, settings%branch_ratio, &
            settings%damper_ratio]
      end associate
   end function keys

end module stop_surfaces
