!> The surfaces that a beam can meet: one of a stop below or above it, two of a stop on both sides.
!>
!> With the sign s = 1 below and -1 above all of them are alike: the gap of a surface at height d is s (y - d), and its
!> force acts on the beam along s.
module stop_contacts
   use kinds, only: wp
   use load_settings, only: start_release
   use run_settings, only: law_restitution, law_spring_damper, run_settings_t, side_above, side_below, side_both, &
      stop_settings_t
   implicit none (type, external)
   private
   public :: contact_t, contacts_of, stops_of, has_one_contact, active_contacts, touch_tolerance, is_beyond

   type :: contact_t
      !> Which &stop of the scene it belongs to, and which surface of all in the scene's order, below before above
      integer :: stop = 1
      integer :: number = 1
      !> s
      real(wp) :: sign = 1.0_wp
      !> s d in units of displacement: the same as the `preload` of its stop
      real(wp) :: height = 0.0_wp
      !> The beam is released from it
      logical :: is_release_contact = .false.
      !> Position, law and what that has
      type(stop_settings_t) :: settings
   end type contact_t

   !> More than rounding, less than anything meant, in the unit of displacement.
   real(wp), parameter :: most_beyond = 1.0e-9_wp

contains

   !> A start that lies beyond a surface by this at most touches it, and is moved onto it; one that lies further beyond
   !> is refused.
   elemental function touch_tolerance(contact) result(tolerance)
      type(contact_t), intent(in) :: contact
      real(wp) :: tolerance

      tolerance = most_beyond*max(1.0_wp, abs(contact%height))
   end function touch_tolerance

   !> Does a start with this gap lie beyond the surface, not on it?
   elemental function is_beyond(contact, gap) result(answer)
      type(contact_t), intent(in) :: contact
      real(wp), intent(in) :: gap
      logical :: answer

      answer = gap < -touch_tolerance(contact)
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
      answer = answer .and. settings%start%kind == start_release .and. .not. (allocated(settings%forces) .or. &
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
   pure function contacts_of(settings) result(contacts)
      type(run_settings_t), intent(in) :: settings
      type(contact_t), allocatable :: contacts(:)

      type(stop_settings_t), allocatable :: stops(:)
      type(contact_t) :: contact
      integer :: i, place, total

      allocate (stops, source=stops_of(settings))
      allocate (contacts(2*size(stops)))
      total = 0
      do i = 1, size(stops)
         contact = contact_t(stop=i, height=stops(i)%preload, settings=stops(i))
         if (stops(i)%side /= side_above) then
            contact%sign = 1.0_wp
            contact%is_release_contact = i == settings%release_stop
            total = total + 1
            contact%number = total
            contacts(total) = contact
         end if
         if (stops(i)%side /= side_below) then
            contact%sign = -1.0_wp
            contact%is_release_contact = i == settings%release_stop .and. stops(i)%side /= side_both
            total = total + 1
            contact%number = total
            contacts(total) = contact
         end if
      end do
      do i = 2, total
         contact = contacts(i)
         place = i
         do while (place > 1)
            if (.not. stands_before(contact, contacts(place - 1))) exit
            contacts(place) = contacts(place - 1)
            place = place - 1
         end do
         contacts(place) = contact
      end do
      contacts = contacts(:total)
   end function contacts_of

   !> Which of them act? Of rigid ones at one point and on one side the highest does alone, of equal ones the one with
   !> the greatest restitution.
   pure function active_contacts(contacts, dofs) result(is_active)
      type(contact_t), intent(in) :: contacts(:)
      !> Degree of freedom of each
      integer, intent(in) :: dofs(:)
      logical :: is_active(size(contacts))

      real(wp) :: difference
      integer :: i, k

      is_active = .true.
      do k = 1, size(contacts)
         do i = 1, size(contacts)
            if (i == k .or. dofs(i) /= dofs(k) .or. contacts(i)%sign*contacts(k)%sign < 0.0_wp) cycle
            if (any([contacts(i)%settings%law, contacts(k)%settings%law] /= law_restitution)) cycle
            difference = contacts(i)%height - contacts(k)%height
            if (.not. abs(difference) > 0.0_wp) then
               difference = contacts(i)%settings%restitution - contacts(k)%settings%restitution
            end if
            if (difference > 0.0_wp .or. (.not. abs(difference) > 0.0_wp .and. i < k)) is_active(k) = .false.
         end do
      end do
   end function active_contacts

   !> Does one surface stand before another? Those that are alike in all keep the scene's order.
   elemental function stands_before(one, other) result(answer)
      type(contact_t), intent(in) :: one
      type(contact_t), intent(in) :: other
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
   pure function keys(contact) result(values)
      type(contact_t), intent(in) :: contact
      real(wp) :: values(9)

      associate (settings => contact%settings)
         values = [settings%position, -contact%sign, -contact%height, real(settings%law, wp), &
            real(settings%impulse, wp), -settings%restitution, settings%stiffness_ratio, settings%branch_ratio, &
            settings%damper_ratio]
      end associate
   end function keys

end module stop_contacts
