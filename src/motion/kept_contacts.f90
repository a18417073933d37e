!> What contacts with one stop have in common, kept for the runs that follow with the same beam, damping and stop.
module kept_contacts
   use contact_losses, only: contact_losses_t
   use contact_modes, only: contact_modes_t, make_contact_modes
   use failures, only: failure_t
   use kinds, only: wp
   use modal_beam, only: modal_beam_t
   use yielding_stop, only: impedance_t
   implicit none (type, external)
   private
   public :: kept_contact_t, contact_store_t, find_contact

   type :: kept_contact_t
      !> The beam that it is of, [modes], and the stop
      real(wp), allocatable :: square(:), stop_value(:), tip_value(:)
      real(wp) :: two_zeta = 0.0_wp
      type(impedance_t) :: spring
      !> Exponents, and what they dissipate, made where it is asked for
      type(contact_modes_t) :: modes
      type(contact_losses_t) :: losses
   end type kept_contact_t

   !> So many are kept, as long as they take no more bytes than this.
   integer, parameter :: most_kept = 64
   real(wp), parameter :: most_bytes = 5.0e7_wp

   type :: contact_store_t
      private
      type(kept_contact_t), allocatable :: place(:)
      integer :: count = 0
   end type contact_store_t

contains

   !> The contacts of a beam with a stop, made if there are none yet. What was found before may be gone then.
   subroutine find_contact(beam, spring, store, kept, error)
      type(modal_beam_t), intent(in) :: beam
      class(impedance_t), intent(in) :: spring
      type(contact_store_t), target, intent(inout) :: store
      type(kept_contact_t), pointer, intent(out) :: kept
      !> Set when the exponents are not found
      type(failure_t), allocatable, intent(inout) :: error

      integer :: i

      if (.not. allocated(store%place)) allocate (store%place(most_kept))
      do i = 1, store%count
         kept => store%place(i)
         if (is_alike(kept, beam, spring)) return
      end do
      if (store%count == most_kept .or. real(store%count + 1, wp)*bytes_of(beam%count) > most_bytes) store%count = 0
      kept => store%place(store%count + 1)
      call make_kept(beam, spring, kept, error)
      if (.not. allocated(error)) store%count = store%count + 1
   end subroutine find_contact

   subroutine make_kept(beam, spring, kept, error)
      type(modal_beam_t), intent(in) :: beam
      class(impedance_t), intent(in) :: spring
      type(kept_contact_t), intent(out) :: kept
      !> Set when the exponents are not found
      type(failure_t), allocatable, intent(inout) :: error

      allocate (kept%square, source=beam%oscillators%square)
      allocate (kept%stop_value, source=beam%stop_value)
      allocate (kept%tip_value, source=beam%tip_value)
      kept%two_zeta = beam%oscillators%two_zeta
      kept%spring = impedance_t(spring%stiffness, spring%branch_stiffness, spring%relaxation_rate)
      call make_contact_modes(beam, 0.5_wp*kept%two_zeta, spring, kept%modes, error)
   end subroutine make_kept

   !> Is it of this beam and this stop, to the last bit?
   pure function is_alike(kept, beam, spring) result(answer)
      type(kept_contact_t), intent(in) :: kept
      type(modal_beam_t), intent(in) :: beam
      class(impedance_t), intent(in) :: spring
      logical :: answer

      answer = size(kept%square) == beam%count
      if (answer) answer = is_equal(kept%two_zeta, beam%oscillators%two_zeta) .and. &
         is_equal(kept%spring%stiffness, spring%stiffness) .and. &
         is_equal(kept%spring%branch_stiffness, spring%branch_stiffness) .and. &
         is_equal(kept%spring%relaxation_rate, spring%relaxation_rate)
      if (answer) answer = all(is_equal(kept%square, beam%oscillators%square)) .and. &
         all(is_equal(kept%stop_value, beam%stop_value)) .and. all(is_equal(kept%tip_value, beam%tip_value))
   end function is_alike

   elemental function is_equal(a, b) result(answer)
      real(wp), intent(in) :: a
      real(wp), intent(in) :: b
      logical :: answer

      answer = a <= b .and. a >= b
   end function is_equal

   !> What one takes, but for what is small.
   pure function bytes_of(modes) result(bytes)
      !> Of the beam
      integer, intent(in) :: modes
      real(wp) :: bytes

      ! shapes; dissipation of pairs of exponents, as complex numbers and over a step
      bytes = 400.0_wp*real(modes + 1, wp)**2
   end function bytes_of

end module kept_contacts
